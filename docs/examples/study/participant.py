"""A program that takes part in a study, without swarm-pz: it answers with first choices, and draws once a game.

The server answers these requests; transcript.txt beside this file shows the first steps.

POST /study/CODE/state
    Returns the state: what comes next for a participant. Ask for it every two seconds.
POST /study/CODE/done
    Finishes a step; returns the next state. Takes the step's id as `step`, and for a form `answers` by question id.
POST /study/CODE/play
    Marks the participant as ready for the game `step`; returns the state.
POST /study/CODE/stop
    Stops for good; returns the state. With `delete` true, all of the participant's data are deleted: then `withdrawn`
    is true, and `html` is the debriefing.
GET /study/CODE/consent
    Returns the participant's copy of the consent.
GET /socket
    The WebSocket of the game; docs/protocol.md explains it.
GET /study/monitor/data
    JSON: `title`, `games` per block, and one of `rows` per participant. Needs the header `Authorization: Bearer TOKEN`.
GET /status
    JSON: the server's figures.
GET / /study /study/CODE /study/CODE/game /study/monitor /static
    The pages.

The body of a POST is a JSON object with `window`, a text that is unique to the program, `loaded`, when it started, and
optionally `here`: true takes over the session. It is safe to repeat a request. In the state:

elsewhere
    True if another window has the session; then the rest is missing.
done, of
    Number of steps done, and of all steps known so far.
step
    The next step, missing at the end: `id`, `kind` ("consent", "form", "text", "break", "practice" or "game"),
    `heading`; `html` of a text; `items` of a form, and `attempt`, from 1; `seconds` left of a break.
may_stop, consented
    True if `stop` does something, and if there is a consent to copy.
completion
    At the end: the study's code or address of completion, if all was done.
game
    `phase`: in "before" send `play`; "waiting" is for the other player; "ready", "running" and "saving" have a `seat`
    with `room`, `seat` and `token`. Send this token in `hello`.
refused
    Why the request was refused; nothing has changed.

Errors are JSON, {"fault": "..."}: 400 for a bad body, 404 and 410 for an unknown or withdrawn code, 429 after too many
wrong codes, 409, 503 and 500 if data cannot be read or written, and 403 for a wrong token, Host or Origin.
"""

import json
import time
import urllib.request

from websockets.sync.client import connect


def take_part(address, code):
    """Take part in the study at HOST:PORT with a participant's code; return the ids of its steps."""

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
