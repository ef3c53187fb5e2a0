"""A study on its own server, and scripted participants."""

import http.client
import json
import threading
import time
import urllib.error
import urllib.request

from websockets.exceptions import ConnectionClosed, InvalidMessage

from swarm_pz.play import protocol
from swarm_pz.play.studies.folder import StudyFolder
from tests.play.conftest import Client, Server

PATIENCE_S = 1200.0
"""Longest time that a participant may take, on the slowest machine."""


class StudyTable(Server):
    """A study's server, with its address and its monitor's token; it can be killed and started again."""

    def __init__(self, file, folder):
        self.file, self.folder = file, folder
        self.start()

    def start(self):
        options = ("--folder", str(self.folder), "--port", "0", "--countdown", "0")
        self.note(self.begin("study", "run", str(self.file), *options, until="/study/monitor#"))

    def note(self, line):
        self.token = line.strip().split("#")[1]
        self.address = line.split("http://")[1].split("/")[0]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Leave no server behind, whatever went wrong."""
        if self.process.returncode is None:
            self.kill()

    def ask(self, path, body=None, **headers):
        """Request a path, with `body` as a POST if given; return the status and the response."""
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        request = urllib.request.Request(f"http://{self.address}{path}", data=data, headers=headers)
        try:
            answer = urllib.request.urlopen(request, timeout=30)  # noqa: S310
        except urllib.error.HTTPError as error:
            answer = error
        with answer:
            text = answer.read().decode()
            return answer.status, json.loads(text) if "json" in answer.headers["content-type"] else text

    def monitor(self):
        """Return the monitor's rows, by name."""
        _, response = self.ask("/study/monitor/data", authorization=f"Bearer {self.token}")
        return {row["name"]: row for row in response["rows"]}

    @property
    def kept(self):
        """Read the folder as it is now."""
        return StudyFolder(self.folder)


class Participant:
    """Answers, plays, and tries again while the server is down; `done` lists the confirmed steps."""

    def __init__(self, table, code):
        self.table, self.code, self.done = table, code, []
        self.window, self.loaded = f"window of {code}", time.time()

    def say(self, act, **more):
        """Post an action, and return the study's state for this participant."""
        body = {"window": self.window, "loaded": self.loaded, **more}
        status, state = self.table.ask(f"/study/{self.code}/{act}", body)
        assert status == 200, state
        return state

    def walk(self, until=lambda step: False):
        """Do step after step, until all are done or `until(step)` is true; return the last state."""
        end, state = time.monotonic() + PATIENCE_S, {}
        while time.monotonic() < end:
            try:
                state = self.say("state")
                step = state.get("step")
                if step is None or until(step):
                    return state
                assert step["id"] not in self.done, f"{self.code} is asked {step['id']} twice"
                self.do(state)
            except (OSError, http.client.HTTPException, ConnectionClosed, InvalidMessage, TimeoutError):
                time.sleep(0.2)  # the server is gone, or its game
        raise AssertionError(f"{self.code} does not get on: {state}")

    def do(self, state):
        """Do one step."""
        step = state["step"]
        if step["kind"] in ("game", "practice"):
            self.play(step, state["game"])
            return
        time.sleep(step.get("seconds", 0.0))
        sent = {"answers": {item["id"]: answer_to(item) for item in step["items"]}} if step["kind"] == "form" else {}
        after = self.say("done", step=step["id"], **sent)
        assert "refused" not in after, after
        self.done.append(step["id"])

    def play(self, step, game):
        if game["phase"] not in ("ready", "running"):
            game = self.say("play", step=step["id"]).get("game", {})
        if "seat" not in game or game["phase"] == "saving":
            time.sleep(0.1)
            return
        assert not game["fault"], game
        if self.finish(game["seat"]["token"]) != "stopped":
            while (after := self.say("state")).get("game", {}).get("phase") == "saving":
                time.sleep(0.05)
            if (after.get("step") or {}).get("id") != step["id"]:
                self.done.append(step["id"])

    def finish(self, token):
        """Play a game to its end, with one command; return its outcome."""
        client = Client(self.table.address, token)
        try:
            commands = client.hear(protocol.Seated).commands
            command = {"command": commands.default}
            if commands.takes == "density":
                command = {"density": [[float(column == 9) for column in range(10)]] * 10}
            client.hear(protocol.RoomState, lambda room: room.phase != "waiting")
            client.say(protocol.CommandMessage(1, **command))
            return client.hear(protocol.RoomState, lambda room: room.phase == "over").outcome
        except AssertionError as error:
            if "refused" in str(error):  # the seat is gone, or the game over before the command came
                return "stopped"
            raise
        finally:
            client.close()


def answer_to(item):
    """Return an answer to a question."""
    if item["kind"] in ("choice", "pair"):
        return item["choices"][0]
    return "fine" if item["kind"] == "text" else item["least"]


def walk_all(participants, meanwhile=lambda: None):
    """Let participants do all their steps at the same time, and call `meanwhile`."""
    faults = []

    def walk(one):
        try:
            one.walk()
        except BaseException as error:
            faults.append(f"{one.code}: {error!r}")

    threads = [threading.Thread(target=walk, args=[one]) for one in participants]
    for thread in threads:
        thread.start()
    meanwhile()
    for thread in threads:
        thread.join()
    assert not faults, faults
