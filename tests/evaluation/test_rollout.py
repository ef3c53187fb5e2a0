"""One loop plays all games: seed, pair and side fix a game, however it is watched and whatever is played beside it."""

import pickle
import sys

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import BLUE, RED, CaptureConfig, ControllerConfig, GameConfig
from swarm_pz.errors import CommandError
from swarm_pz.evaluation.rollout import FaultError, Rollout, game_number, play_games

SHORT = GameConfig(time_limit=8.0, drones_per_team=3)


class Ones:
    """Covers evenly; each command takes some milliseconds of a clock that only this class moves."""

    observation = policies.load("uniform").observation
    clock = 0.0

    def __init__(self, milliseconds=0.0):
        self.milliseconds, self.name = milliseconds, f"thinks {milliseconds} ms"

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        Ones.clock += 1e-3 * self.milliseconds * len(rows)
        return np.ones((len(rows), 10, 10))


class Events:
    """Keeps one game's state after every control period."""

    def __init__(self, row):
        self.row, self.states = row, []

    def __call__(self, rollout):
        now = b"".join(np.ascontiguousarray(array[self.row]).tobytes() for array in rollout.simulator.games)
        if not self.states or now != self.states[-1]:  # an ended game stays as it is
            self.states.append(now)


@pytest.mark.parametrize(("policy", "opponent"), [("champion", "ring"), ("noise", "exploring champion")])
def test_the_game_shown_is_the_game_evaluated_bit_for_bit(policy, opponent):
    def player(name):
        made = policies.load(name.split()[-1], SHORT)
        if name.startswith("exploring"):  # its actions have noise from its random stream
            made.noise = 0.3
        return made

    numbers = [game_number(5, "red"), game_number(5, "blue"), game_number(3, "blue")]
    among = [Events(number) for number in numbers]
    many = Rollout(player(policy), player(opponent), range(12), seed=6, config=SHORT)
    many.play(after_control_period=lambda rollout: [events(rollout) for events in among])
    unwatched = play_games(player(policy), player(opponent), range(12), seed=6, config=SHORT, threads=2)
    assert many.games() == unwatched, "looking changes nothing"
    for number, events in zip(numbers, among, strict=True):
        alone = Events(0)
        one = Rollout(player(policy), player(opponent), [number], seed=6, config=SHORT)
        one.play(after_control_period=alone)
        assert alone.states == events.states
        assert one.games() == [unwatched[number]]
    assert [(unwatched[number].pair, unwatched[number].side) for number in numbers] == [
        (5, "red"), (5, "blue"), (3, "blue"),
    ]  # fmt: skip


def test_a_game_goes_on_where_it_was_left_and_says_how_it_stands():
    times, steps = [], []
    config = GameConfig(drones_per_team=1, time_limit=3.0, capture=CaptureConfig(enabled=False))
    game = Rollout("uniform", "halo", [0, 1], config=config)
    watch = {
        "after_control_period": lambda game: times.append(float(game.simulator.time_s[0])),
        "after_step": lambda game: steps.append(game.rows.tolist()),
    }
    game.play(1.5, **watch)
    assert game.standing() == "unfinished (2.0 s, red 1, blue 1)"
    with pytest.raises(CommandError, match="unfinished"):
        game.games()
    game.play(**watch)
    np.testing.assert_allclose(times, np.arange(1, 31) / 10)
    assert steps == [[0, 1]] * 3 and game.standing(1) == "a draw (3.0 s, red 1, blue 1)"
    assert (game.names(0), game.names(1)) == (("uniform", "halo"), ("halo", "uniform"))


@pytest.mark.parametrize(("leave", "error"), [(lambda *_: 1 / 0, "ZeroDivisionError"), (sys.exit, "SystemExit")])
def test_a_policy_that_raises_is_named_with_its_place(leave, error):
    broken = Ones()
    broken.name, broken.reset = "broken", lambda *_: leave(0)
    with pytest.raises(FaultError, match=rf"policy broken raised {error}.* \(test_rollout.py:\d+\)") as fault:
        Rollout("uniform", broken, [0])
    from_another_process = pickle.loads(pickle.dumps(fault.value))  # noqa: S301
    assert (from_another_process.place, str(from_another_process)) == (1, str(fault.value))


def test_a_game_that_ends_early_has_its_own_end_among_others_that_go_on(monkeypatch):
    monkeypatch.setattr("swarm_pz.evaluation.rollout.time.perf_counter", lambda: Ones.clock)
    still = ControllerConfig(max_acceleration=1e-9)  # in four corners, where nobody is captured
    config = GameConfig(drones_per_team=2, time_limit=3.0, command_period=0.5, controller=still)
    game = Rollout(Ones(3), Ones(5), [0, 3, 5], config=config)
    game.batch.reset(range(3), scenario={"positions": [[0.1, 0.1], [0.9, 0.1], [0.1, 0.9], [0.9, 0.9]]})
    rows = []

    def take_over(game):
        rows.append(game.rows.tolist())
        if len(rows) == 6:  # at 0.6 s: blue takes all in the first game, red in the second
            game.simulator.games.teams[0], game.simulator.games.teams[1] = BLUE, RED

    game.play(1.2, after_control_period=take_over)
    assert game.finished == 2
    standings = ["blue won (0.6 s, red 0, blue 4)", "red won (0.6 s, red 4, blue 0)"]
    assert [game.standing(row) for row in range(3)] == [*standings, "unfinished (1.5 s, red 2, blue 2)"]
    game.play(after_control_period=take_over)
    assert rows[9:11] == [[0, 1, 2], [2]]
    assert [game.standing(row) for row in range(3)] == [*standings, "a draw (3.0 s, red 2, blue 2)"]
    assert [game.names(row)[0] for row in range(3)] == ["thinks 3 ms", "thinks 5 ms", "thinks 5 ms"]
    games = game.games()
    assert [(one.outcome, one.share, one.seconds) for one in games] == [
        ("loss", 0.0, pytest.approx(0.6)),
        ("loss", 0.0, pytest.approx(0.6)),  # with the policy as blue
        ("draw", 0.5, pytest.approx(3.0)),
    ]
    assert [one.sizes for one in games] == [[2, 2, 0], [2, 2, 4], [2] * 7]
    assert all(one.thinking_ms == pytest.approx((3.0, 5.0)) for one in games)
