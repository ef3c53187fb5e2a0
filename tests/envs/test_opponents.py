from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.envs.opponents import DuelBatch
from swarm_pz.errors import ConfigError, GameOverError, PolicyError

SMALL = GameConfig(drones_per_team=2)


class Diary:
    """An opponent that keeps all that it is told and asked, and asks for more in each game than in the one before."""

    observation = ObservationConfig(grid=10, channels=("own_share",))

    def __init__(self, cells=10):
        self.cells, self.begun, self.asked, self.shown = cells, {}, [], []

    def reset(self, seeds, rows):
        self.begun |= dict(zip(rows.tolist(), seeds, strict=True))

    def act(self, observations, rows):
        self.asked.append(rows.tolist())
        self.shown.append(observations[:, 0, 0, 0].tolist())
        return np.stack([np.arange(self.cells**2).reshape(self.cells, -1) == row for row in rows]).astype(float)


def begin(duel, seed=0):
    count = duel.batch.num_games
    duel.reset([np.random.SeedSequence(seed + row) for row in range(count)], np.arange(count))


def test_a_seed_always_gives_the_same_side_and_the_same_stream_to_the_opponent():
    # Whoever published a seed's game may count on it.
    diary = Diary()
    duel = DuelBatch(SMALL, 16, opponent=diary)
    begin(duel)
    assert duel.sides.tolist() == [1, 0, 1, 1, 1, 1, 0, 0, 0, 0, 0, 1, 0, 1, 1, 0]
    assert diary.begun[3].generate_state(2).tolist() == [487619062, 2305468573]
    duel.reset(np.random.SeedSequence(0, pool_size=8).spawn(2), np.array([5, 1]))
    assert (diary.begun[5].spawn_key, diary.begun[1].spawn_key) == ((0, 1_000_002), (1, 1_000_002))
    assert diary.begun[5].pool_size == 8


def test_each_opponent_gets_the_streams_of_its_own_games():
    alone, first, second = Diary(), Diary(), Diary()
    begin(DuelBatch(SMALL, 5, opponent=alone))
    begin(DuelBatch(SMALL, 5, opponent=[first, second]))
    assert (list(first.begun), list(second.begun)) == ([0, 2, 4], [1, 3])
    for row, stream in (first.begun | second.begun).items():
        np.testing.assert_array_equal(stream.generate_state(2), alone.begun[row].generate_state(2))


def test_a_seed_given_is_not_changed():
    seeds = np.random.SeedSequence(0).spawn(3)
    DuelBatch(SMALL, 3).reset(seeds, np.arange(3))
    assert [seed.n_children_spawned for seed in seeds] == [0, 0, 0]


@pytest.mark.parametrize("side", [0, 1])
def test_who_sits_where_sees_commands_is_rewarded_and_told_as_its_own_side(side):
    diary = Diary()
    duel = DuelBatch(
        GameConfig(drones_per_team=(1, 3)), 2, opponent=diary, side=("red", "blue")[side], action="command"
    )
    begin(duel)
    assert duel.sides.tolist() == [side] * 2
    share = 0.25
    assert (duel.observe()[:, 7] == round(255 * share)).all()
    infos = duel.infos()
    assert infos["share"].tolist() == [share] * 2 and infos["side"].tolist() == [side] * 2
    actions = np.zeros((2, 10, 10))
    actions[:, 9, 9] = 1.0
    result = duel.step(actions)
    assert diary.shown == [[round(255 * (1 - share))] * 2]
    targets = duel.batch.simulator.targets.reshape(2, 2, 100).argmax(axis=-1)
    assert targets[:, side].tolist() == [99, 99] and targets[:, 1 - side].tolist() == [0, 1]
    np.testing.assert_array_equal(result.rewards, result.result.rewards[:, side])


def test_opponents_are_not_asked_about_games_that_have_ended():
    diary = Diary()
    duel = DuelBatch(SMALL, 3, opponent=diary)
    begin(duel)
    duel.batch.running[1] = False
    result = duel.step(np.zeros((3, 10, 10)))
    assert diary.asked == [[0, 2]]
    assert duel.batch.simulator.time_s.tolist() == [1.0, 0.0, 1.0]
    assert result.rewards[1] == 0.0 and not (result.terminated[1] or result.truncated[1])
    duel.batch.running[:] = False
    with pytest.raises(GameOverError, match="no game is running"):
        duel.step(np.zeros((3, 10, 10)))


def test_some_games_are_seen_and_told_of_alone():
    duel = DuelBatch(GameConfig(drones_per_team=(1, 3)), 6, opponent=["uniform", "ring", "uniform"])
    begin(duel, seed=4)
    assert len(set(duel.sides.tolist())) == 2
    rows = np.array([4, 1])
    np.testing.assert_array_equal(duel.observe(rows), duel.observe()[rows])
    every, some = duel.infos(), duel.infos(None, rows)
    for name, values in every.items():
        np.testing.assert_array_equal(some[name], values[rows])
    assert every["opponent"].tolist() == [0, 1, 0] * 2
    np.testing.assert_array_equal(every["size"], 1)


def test_one_opponent_of_several_games_is_one_object_asked_once():
    diary = Diary()
    duel = DuelBatch(SMALL, 4, opponent=[diary, "uniform", diary])
    begin(duel)
    duel.step(np.zeros((4, 10, 10)))
    assert diary.asked == [[0, 2, 3]]
    assert duel.opponent_names == ["Diary", "uniform"]


def test_a_deal_that_cannot_be_leaves_the_old_one():
    duel = DuelBatch(SMALL, 2, opponent="ring")
    for bad, kind in (([], ConfigError), (["uniform", "rign"], PolicyError), (["uniform", "noise"], ValueError)):
        with pytest.raises(kind):
            duel.deal(bad, ["alone"] if bad == ["uniform", "noise"] else None)
        begin(duel)
        assert [duel.opponent_names[number] for number in duel.infos()["opponent"]] == ["ring"] * 2


def test_names_may_be_said_and_keep_their_numbers():
    duel = DuelBatch(SMALL, 3)
    duel.deal(["ring", "noise", "ring"], ["first", "second", "third"])
    begin(duel)
    duel.deal(("noise", "ring"), ["second", "first"])
    assert duel.opponent_names == ["uniform", "first", "second", "third"]
    assert duel.infos()["opponent"].tolist() == [1, 2, 3]
    begin(duel)
    assert duel.infos()["opponent"].tolist() == [2, 1, 2]
