from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.envs.opponents import DuelBatch
from swarm_pz.errors import ConfigError, GameOverError, PolicyError
from swarm_pz.policies.scripted import ScriptedPolicy
from swarm_pz.policy import is_constant, load, registered
from tests.games import assert_same

SMALL = GameConfig(drones_per_team=2)


class Diary:
    """An opponent that records its calls, and commands one cell: `cell`, or its game's number."""

    observation = ObservationConfig(grid=10, channels=("own_share",))

    def __init__(self, cell=None):
        self.cell, self.begun, self.rows, self.shown = cell, {}, [], []

    def reset(self, seeds, rows):
        self.begun |= dict(zip(rows.tolist(), seeds, strict=True))

    def act(self, observations, rows):
        self.rows += rows.tolist()
        self.shown += observations[:, 0, 0, 0].tolist()
        return np.eye(100)[rows if self.cell is None else [self.cell] * len(rows)].reshape(-1, 10, 10)


def begun(config=SMALL, games=2, seed=0, **options):
    duel = DuelBatch(config, games, **options)
    begin(duel, seed)
    return duel


def begin(duel, seed=0):
    count = duel.batch.num_games
    duel.reset([np.random.SeedSequence(seed + row) for row in range(count)], np.arange(count))


def step(duel):
    return duel.step(np.zeros((duel.batch.num_games, 10, 10)))


def names_met(duel):
    return [duel.opponent_names[number] for number in duel.infos()["opponent"]]


def test_a_seed_always_gives_the_same_side_and_the_same_stream_to_the_opponent():
    # A published seed must keep its game.
    diary = Diary()
    duel = begun(games=16, opponent=diary)
    assert duel.sides.tolist() == [1, 0, 1, 1, 1, 1, 0, 0, 0, 0, 0, 1, 0, 1, 1, 0]
    assert diary.begun[3].generate_state(2).tolist() == [487619062, 2305468573]
    seeds = np.random.SeedSequence(0, pool_size=8).spawn(2)
    duel.reset(seeds, np.array([5, 1]))
    assert [seed.n_children_spawned for seed in seeds] == [0, 0], "a seed is not changed"
    assert (diary.begun[5].spawn_key, diary.begun[1].spawn_key) == ((0, 1_000_002), (1, 1_000_002))
    assert diary.begun[5].pool_size == 8


def test_each_opponent_gets_the_streams_of_its_own_games_and_is_one_object_asked_once():
    alone, first, second = Diary(), Diary(), Diary()
    begun(games=5, opponent=alone)
    duel = begun(games=5, opponent=[first, second])
    assert (list(first.begun), list(second.begun)) == ([0, 2, 4], [1, 3])
    for row, stream in (first.begun | second.begun).items():
        np.testing.assert_array_equal(stream.generate_state(2), alone.begun[row].generate_state(2))
    step(duel)
    assert (first.rows, second.rows) == ([0, 2, 4], [1, 3])
    twice = begun(games=4, opponent=[first, "uniform", first])
    step(twice)
    assert first.rows[3:] == [0, 2, 3] and twice.opponent_names == ["Diary", "uniform"]


@pytest.mark.parametrize("side", [0, 1])
def test_who_sits_where_sees_commands_is_rewarded_and_told_as_its_own_side(side):
    diary, share = Diary(), 0.25
    config, options = GameConfig(drones_per_team=(1, 3)), {"side": ("red", "blue")[side], "action": "command"}
    duel = begun(config, opponent=diary, **options)
    assert duel.sides.tolist() == [side] * 2
    assert (duel.observe()[:, 7] == round(255 * share)).all()
    infos = duel.infos()
    assert infos["share"].tolist() == [share] * 2 and infos["side"].tolist() == [side] * 2
    result = duel.step(np.eye(100)[[99, 99]].reshape(2, 10, 10))
    assert diary.shown == [round(255 * (1 - share))] * 2
    targets = duel.batch.simulator.targets.reshape(2, 2, 100).argmax(axis=-1)
    assert targets[:, side].tolist() == [99, 99] and targets[:, 1 - side].tolist() == [0, 1]
    assert result.rewards.tolist() == [0.0, 0.0]

    def win():
        duel.batch.simulator.games.teams[0] = side

    assert duel.step(np.ones((2, 10, 10)), win).rewards.tolist() == [1.0, 0.0]


@pytest.mark.parametrize("name", [name for name in registered() if is_constant(name)])
def test_an_opponent_that_never_changes_is_asked_once_a_game(name, monkeypatch):
    calls, act = [], ScriptedPolicy.act
    monkeypatch.setattr(ScriptedPolicy, "act", lambda self, images, rows: calls.append(self) or act(self, images, rows))
    once, always = (begun(games=3, opponent=opponent) for opponent in (name, load(name, SMALL)))
    for number in range(4):
        for duel in (once, always):
            if number == 2:
                duel.reset(np.random.SeedSequence(9).spawn(1), np.array([1]))
            step(duel)
    assert_same(once.batch.simulator.games, always.batch.simulator.games)
    assert len(calls) == 2 + 4


def test_opponents_are_not_asked_about_games_that_have_ended():
    diary = Diary()
    duel = begun(games=3, opponent=diary)
    duel.batch.running[1] = False
    result = step(duel)
    assert diary.rows == [0, 2]
    assert duel.batch.simulator.time_s.tolist() == [1.0, 0.0, 1.0]
    assert result.rewards[1] == 0.0 and not (result.terminated[1] or result.truncated[1])
    duel.batch.running[:] = False
    with pytest.raises(GameOverError, match="no game is running"):
        step(duel)


def test_a_deal_is_for_the_games_that_begin_and_running_ones_keep_their_opponents():
    first, second, third = (Diary(cell) for cell in range(3))
    duel = begun(games=4, opponent=[first, second])
    duel.deal(third, ["third"])
    duel.reset(np.random.SeedSequence(1).spawn(1), np.array([2]))
    step(duel)
    assert (first.rows, second.rows, list(third.begun), third.rows) == ([0], [1, 3], [2], [2])
    targets = duel.batch.simulator.targets[np.arange(4), 1 - duel.sides]
    assert targets.reshape(4, -1).argmax(axis=1).tolist() == [0, 1, 2, 1]
    assert names_met(duel) == ["Diary", "Diary", "third", "Diary"]


def test_a_deal_that_cannot_be_leaves_the_old_one():
    duel = DuelBatch(SMALL, 2, opponent="ring")
    for bad, kind in (([], ConfigError), (["uniform", "rign"], PolicyError), (["uniform", "noise"], ValueError)):
        with pytest.raises(kind):
            duel.deal(bad, ["alone"] if bad == ["uniform", "noise"] else None)
        begin(duel)
        assert names_met(duel) == ["ring"] * 2
