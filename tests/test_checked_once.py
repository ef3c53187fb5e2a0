"""A density is checked once on its way from whoever asks for it to the simulator."""

from __future__ import annotations

import asyncio
import math
import sys
from contextlib import contextmanager

import numpy as np
import pytest

import swarm_pz
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.values import check_values
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.envs.gymnasium_vector_env import DuelVectorEnv
from swarm_pz.envs.parallel_env import CaptureEnv
from swarm_pz.errors import CommandError, PolicyError
from swarm_pz.evaluation.match import play_match
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.play import protocol
from swarm_pz.play.recordings.format import CommandLine, InForceLine, Recording
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.server.rendered_command import render as make
from swarm_pz.play.server.room import Room
from swarm_pz.play.server.server_context import ServerContext
from swarm_pz.policies.lookahead import Lookahead
from swarm_pz.simulator import Simulator
from swarm_pz.training.vec_env import SwarmVecEnv

ONE_STEP = GameConfig(time_limit=1.0)
GOOD = np.full((10, 10), 0.5)
BAD = np.where(np.eye(10) > 0, np.nan, 0.5)


class Constant:
    """Always asks for the same density; checks nothing itself."""

    name, observation = "constant", ObservationConfig(grid=10, channels=("time_left",))

    def __init__(self, density=GOOD):
        self._density = density

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        return np.stack([self._density] * len(rows))


@contextmanager
def checks():
    """List how many densities each check in here is of, whoever calls for it."""
    checked = []

    def look(frame, event, _):
        if event == "call" and frame.f_code is check_values.__code__:
            checked.append(math.prod(frame.f_locals["shape"]) // GOOD.size)

    sys.setprofile(look)
    try:
        yield checked
    finally:
        sys.setprofile(None)


def batch(red, blue):
    games = BatchEnv(num_games=2)
    games.reset([0, 1])
    return games.simulator, lambda: games.step([[red, blue]] * 2)


def parallel(red, blue):
    environment = CaptureEnv()
    environment.reset(seed=0)
    return environment.batch.simulator, lambda: environment.step({"red_0": red, "blue_0": blue})


def in_turn(red, blue):
    environment = swarm_pz.env()
    environment.reset(seed=0)
    return environment.unwrapped.batch.simulator, lambda: [environment.step(action) for action in (red, blue)]


def gymnasium(red, blue):
    environment = DuelEnv(opponent=Constant(blue))
    environment.reset(seed=0)
    return environment.duel.batch.simulator, lambda: environment.step(red)


def vector(red, blue):
    environment = DuelVectorEnv(2, opponent=Constant(blue))
    environment.reset(seed=0)
    return environment.duel.batch.simulator, lambda: environment.step([red, red])


def sb3(red, blue):
    environment = SwarmVecEnv(num_envs=2, opponent=Constant(blue))
    environment.reset()
    return environment.duel.batch.simulator, lambda: environment.step([red, red])


def rollout(red, blue):
    game = Rollout(Constant(red), Constant(blue), [0])
    return game.simulator, lambda: game.play(1.0)


def match(red, blue):
    return None, lambda: play_match(Constant(red), Constant(blue), games=2, config=ONE_STEP)


def lookahead(red, blue):
    ahead = Lookahead(GameConfig(), horizon=1.0, drone_steps=800, promise=0.1)
    simulator = Simulator()
    simulator.reset([0])
    assert ahead.candidates == 4
    logs = np.log(np.stack([red] * 4))
    return simulator, lambda: ahead.try_out(simulator.snapshot(), 0, logs, Constant(blue))


WRAPPERS = {
    batch: [4],
    parallel: [1, 1],
    in_turn: [1, 1],
    gymnasium: [1, 1],
    vector: [2, 2],
    sb3: [2, 2],
    rollout: [1, 1],
    match: [2, 2],
    lookahead: [4, 4],
}


@pytest.mark.parametrize("wrapper", WRAPPERS)
def test_a_step_checks_each_density_once(wrapper):
    _, step = wrapper(GOOD, GOOD)
    with checks() as checked:
        step()
    assert checked == WRAPPERS[wrapper]


@pytest.mark.parametrize("wrapper", WRAPPERS)
@pytest.mark.parametrize("densities", [(BAD, GOOD), (GOOD, BAD)], ids=["red", "blue"])
def test_a_bad_density_of_either_side_is_refused_and_the_game_stays(wrapper, densities):
    simulator, step = wrapper(*densities)
    with pytest.raises((CommandError, PolicyError), match=r"must be numbers in \[-?[01], 1\] of shape .* got nan at"):
        step()
    assert simulator is None or not simulator.time_s.any()


class Client:
    """A person's connection, which hears what is in force."""

    kind, client = "person", None

    def __init__(self):
        self.in_force = []

    def send(self, message):
        if isinstance(message, protocol.InForceMessage):
            self.in_force.append(message.number)

    def send_bytes(self, data):
        pass

    def show(self, frame, sequence):
        pass


class PolicyWorkers:
    """Gives densities as processes do, which have checked them."""

    async def load(self, place):
        pass

    async def ask(self, place, games, seed, *, begins):
        return GOOD

    def pause(self, place):
        pass


def test_a_room_checks_what_people_ask_for_once_and_what_policies_answer_not_again(tmp_path):
    drawing = [protocol.StrokeMessage(brush="attract", width=0.1, points=[(0.5, 0.5)])]
    asked_for = [{"density": GOOD.tolist()}, {"strokes": drawing}]

    async def play():
        context = ServerContext(folder=tmp_path, workers=PolicyWorkers(), countdown_s=0.0)
        room = Room("ABCD", protocol.Settings(time_limit=None), context)
        client = Client()
        room.sit(client, "red", "")
        room.place_policy("blue", "constant")
        room.ready(client, True)
        while room.phase != "playing":
            await asyncio.sleep(0.02)
        for number, how in enumerate(asked_for, start=1):
            message = protocol.CommandMessage(number=number, **how)
            room.command(client, message, make(message, room.reader, "firm", 0, number))
            while number not in client.in_force:
                await asyncio.sleep(0.02)
        room.stop()
        return Recording.read(room.session.recorder.path)

    with checks() as checked:
        recording = asyncio.run(play())
    assert checked == [1, 1]
    assert {(0, 1), (0, 2), (1, 1)} <= {(line.team, line.number) for line in recording.of(InForceLine)}
    # What is read from a file is checked, and then followed as it is.
    with checks() as checked:
        assert Playback(recording).verify().verified
    assert checked == [1] * len(recording.of(CommandLine))
