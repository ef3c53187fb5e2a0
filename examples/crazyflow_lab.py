"""Flies simulated Crazyflies of Crazyflow in a game in real time, which it reaches only through the rosbridge.

Run `python examples/crazyflow_game.py`: it starts this file beside a server, in an environment with crazyflow.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import time

import numpy as np
from crazyflow import Sim
from crazyflow.control import Control
from websockets.asyncio.client import ClientConnection, connect

CAMERA_HZ, STEPS_HZ = 100, 500
NOISE = 0.001
"""Error of motion capture in metres (standard deviation)."""
SPACING = 0.6
"""Metres between the robots on the floor."""
TOPICS = ("/robots/setpoints", "/swarm/red/poses", "/swarm/blue/poses", "/clock", "/rosout")
CELLS = (np.arange(10) + 0.5) / 10


def ring() -> list[float]:
    """Return a density by rows: a ring around the middle."""
    x, y = np.meshgrid(CELLS, CELLS)
    distance = np.hypot(x - 0.5, y - 0.5)
    return np.exp(-(((distance - 0.25) / 0.08) ** 2)).ravel().tolist()


class Lab:
    """Robots on the floor, a motion capture system, and a player who commands red."""

    def __init__(self, robots: int) -> None:
        self.sim = Sim(n_drones=robots, control=Control.state, freq=STEPS_HZ, attitude_freq=STEPS_HZ)
        self.sim.reset()
        row = np.arange(robots)
        floor = np.column_stack([row % 5 - 2.0, row // 5 - 0.5, np.zeros(robots)]) * (SPACING, 2.0 * SPACING, 1.0)
        states = self.sim.data.states
        self.sim.data = self.sim.data.replace(states=states.replace(pos=states.pos.at[0].set(floor)))
        self.controls = np.zeros((1, robots, 16), np.float32)
        self.controls[0, :, :3], self.controls[..., 12] = floor, 1.0  # no rotation
        self.is_flown = False
        self.sim.state_control(self.controls)
        self.sim.step(STEPS_HZ // CAMERA_HZ)  # compiles
        self.sim.reset()
        self.sim.data = self.sim.data.replace(states=self.sim.data.states.replace(pos=states.pos.at[0].set(floor)))
        self.generator = np.random.default_rng(0)
        self.rows: list[tuple[float, np.ndarray, np.ndarray]] = []
        self.shown: list[tuple[float, float, np.ndarray]] = []
        self.clock = -1.0
        self.outcome = ""

    def step(self, now: float) -> list[dict]:
        """Fly for a period of the cameras, and return the poses that they see."""
        if self.is_flown:
            self.sim.state_control(self.controls)
            self.sim.step(STEPS_HZ // CAMERA_HZ)
        states = self.sim.data.states
        places = np.asarray(states.pos)[0]
        if self.clock >= 0.0:
            self.rows.append(
                (now, np.concatenate([places, np.asarray(states.vel)[0]], axis=1), self.controls[0, :, :6].copy())
            )
        measured = places + self.generator.normal(0.0, NOISE, places.shape)
        return [{"position": dict(zip("xyz", place, strict=True))} for place in measured.tolist()]

    def hear(self, topic: str, message: dict, now: float) -> None:
        """Handle a message that the game publishes."""
        if topic == "/robots/setpoints":
            point = message["points"][0]
            parts = (("transforms", "translation", 0), ("velocities", "linear", 3), ("accelerations", "linear", 6))
            for place, name in enumerate(message["joint_names"]):
                for part, key, first in parts:
                    vector = point[part][place][key]
                    self.controls[0, int(name[5:]), first : first + 3] = [vector[axis] for axis in "xyz"]
                self.is_flown = True
        elif topic == "/clock":
            self.clock = message["clock"]["sec"] + message["clock"]["nanosec"] * 1e-9
        elif topic == "/rosout":
            print(message["msg"], flush=True)
            if "the game is over" in message["msg"]:
                self.outcome = message["msg"]
        elif self.clock > 0.0:  # poses of a team's drones
            places = [[pose["position"][axis] for axis in "xy"] for pose in message["poses"]]
            self.shown.append((now, self.clock, np.array(places).reshape(-1, 2)))


async def play(lab: Lab, address: str) -> None:
    """Fly and command until the game is over."""
    async with connect(address, max_size=None) as there:
        for topic in TOPICS:
            await there.send(json.dumps({"op": "subscribe", "topic": topic}))
        await publish(there, "/red_connection_service", {})
        reading = asyncio.create_task(read(lab, there))
        due = time.monotonic()
        stamp, commanded = 0, False
        while not lab.outcome:
            due = max(due + 1.0 / CAMERA_HZ, time.monotonic() - 0.1)
            await asyncio.sleep(due - time.monotonic())
            stamp += 1
            header = {"stamp": {"sec": stamp // CAMERA_HZ, "nanosec": stamp % CAMERA_HZ * 10**9 // CAMERA_HZ}}
            await publish(there, "/robots/poses", {"header": header, "poses": lab.step(time.monotonic())})
            if not commanded and stamp > 3 * CAMERA_HZ:
                commanded = True
                await publish(there, "/swarm/red/density", {"data": ring()})
        reading.cancel()


async def publish(there: ClientConnection, topic: str, message: dict) -> None:
    """Publish a message."""
    await there.send(json.dumps({"op": "publish", "topic": topic, "msg": message}))


async def read(lab: Lab, there: ClientConnection) -> None:
    """Read published messages."""
    async for data in there:
        message = json.loads(data)
        lab.hear(message["topic"], message["msg"], time.monotonic())


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--address", default="ws://127.0.0.1:9090")
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--out", default="lab.npz")
    arguments = parser.parse_args()
    lab = Lab(arguments.robots)
    print("the robots stand on the floor", flush=True)
    asyncio.run(play(lab, arguments.address))
    seconds, flown, setpoints = zip(*lab.rows, strict=True)
    shown = [place for _, _, place in lab.shown]
    np.savez(
        arguments.out,
        seconds=seconds,
        flown=np.array(flown),
        asked=np.array(setpoints),
        shown_seconds=[now for now, _, _ in lab.shown],
        shown_sizes=[len(places) for places in shown],
        shown=np.concatenate(shown),
    )
