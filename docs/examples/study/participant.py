"""A participant of a study, without swarm-pz: answers with the first choice, and draws once a game."""

import json
import time
import urllib.request

from websockets.sync.client import connect


def take_part(address, code):
    """Do all that a study at HOST:PORT asks of a code; return the ids of the steps."""

    def say(act, **more):
        said = json.dumps({"window": f"pilot of {code}", "here": True, **more}).encode()
        with urllib.request.urlopen(f"http://{address}/study/{code}/{act}", said) as answer:
            return json.load(answer)

    def play(token):
        with connect(f"ws://{address}/socket", subprotocols=["swarm-pz.play.v2"], max_size=None) as socket:
            socket.send(json.dumps({"type": "hello", "kind": "program", "token": token}))
            number = 0
            for data in socket:
                message = json.loads(data) if isinstance(data, str) else {}  # frames are binary
                if message.get("phase") == "over":
                    return
                if message.get("phase") in ("starting", "playing") and number == 0:
                    number = 1
                    strokes = [{"brush": "attract", "width": 0.1, "points": [[0.3, 0.5], [0.7, 0.5]]}]
                    socket.send(json.dumps({"type": "command", "number": number, "strokes": strokes}))

    def answer_to(item):
        return item["choices"][0] if item["choices"] else "" if item["kind"] == "text" else item["least"]

    steps = []
    while step := (state := say("state")).get("step"):
        steps += [step["id"]] if step["id"] not in steps else []
        if step["kind"] == "form":
            say("done", step=step["id"], answers={item["id"]: answer_to(item) for item in step["items"]})
        elif "game" not in state:
            time.sleep(step.get("seconds", 0.0))
            say("done", step=step["id"])
        elif state["game"]["phase"] == "before":
            say("play", step=step["id"])
        elif state["game"]["phase"] in ("ready", "running"):
            play(state["game"]["seat"]["token"])
        else:
            time.sleep(0.5)
    return steps
