from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import BLUE, RED, CaptureConfig, DynamicsConfig, GameConfig, MemoryConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import PolicyError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies import master as module
from swarm_pz.policies import zoo
from swarm_pz.policies.master import Master
from swarm_pz.policies.planner import PlannerConfig, known_tactics
from swarm_pz.policy import Policy, PrivilegedPolicy, load

CONFIG = GameConfig(drones_per_team=5, time_limit=60.0)
SHORT = PlannerConfig(drone_steps=500, horizon=1.0)
KNOWN = ("ring", "uniform", "halo")
ONLY = np.zeros(1, int)


class Tactic:
    """What strangers meet: keeps what it was shown, and asks for one corner."""

    observation = ObservationConfig(channels=("own_positions", "opposing_positions", "own_target", "time_left"))

    def __init__(self):
        self.shown, self.begun, self.seeds = [], [], []

    def reset(self, seeds, rows):
        self.begun += rows.tolist()
        self.seeds += seeds

    def act(self, observations, rows):
        self.shown.append(observations.astype(int))
        corner = np.zeros((len(rows), 10, 10))
        corner[:, 9, 0] = 1.0
        return corner


def a_master(known=KNOWN, tactic=None, config=CONFIG):
    return Master(config, tactic or Tactic(), known, SHORT)


def play(master, opponent, team, steps, count=1, config=CONFIG, look=lambda env: None):
    """Play some commands; return the environment, and what the master gave each time."""
    opponent = load(opponent, config)
    env, rows, given = BatchEnv(config, count), np.arange(count), []
    env.reset(range(count))
    master.reset(list(range(count)), rows)
    opponent.reset([50 + row for row in range(count)], rows)
    for _ in range(steps):
        look(env)
        commands = np.empty((count, 2, 10, 10))
        commands[:, team] = env.ask(master, np.full(count, team), rows)
        commands[:, 1 - team] = env.ask(opponent, np.full(count, 1 - team), rows)
        given.append(commands[:, team].copy())
        env.step(commands)
    return env, given


def recognised(master, row=0):
    """Return whom a master takes its opponent for: a name, None if it has yet to find out, or "stranger"."""
    met = master._met[row]
    return "stranger" if met.is_stranger else None if met.number is None else KNOWN[met.number]


def test_it_sees_drones_and_no_more_and_knows_the_own_tactics():
    master = policies.load("master", CONFIG)
    assert isinstance(master, Policy) and not isinstance(master, PrivilegedPolicy)
    assert (master.name, master.answers, master.observation.kind) == ("master", "density", "drones")
    assert [policy.name for policy in master._known] == known_tactics()
    assert {"veteran", "champion", "uniform", "corners"} <= set(known_tactics())
    folder = Path(zoo.__file__).parent / "hunter"
    assert [one.plays_as for one in (master, a_master(), Master(CONFIG, folder))] == ["veteran", "", str(folder)]


def test_its_digest_is_of_whom_it_knows_of_weights_and_of_how_it_plans(monkeypatch):
    def loaded(name, config):
        policy = load(name, config)
        if name == "hunter":
            policy.digest = "retrained"
        return policy

    made = {
        "itself": Master(CONFIG, "ring", KNOWN),
        "another tactic": Master(CONFIG, "halo", KNOWN),
        "other plans": Master(CONFIG, "ring", KNOWN, SHORT),
        "it knows others": Master(CONFIG, "ring", ("ring", "hunter")),
    }
    assert made["itself"].digest == Master(CONFIG, "ring", KNOWN).digest
    monkeypatch.setattr(module, "load", loaded)
    made["other weights"] = Master(CONFIG, "ring", ("ring", "hunter"))
    assert len({one.digest for one in made.values()}) == len(made)


@pytest.mark.parametrize(("name", "team"), [("ring", RED), ("uniform", BLUE), ("halo", BLUE)])
def test_it_knows_after_one_command_whom_it_meets_and_for_as_long_as_that_is_so(name, team):
    found, master = [], a_master()
    env, _ = play(master, name, team, 5, look=lambda _: found.append(recognised(master)))
    assert found == [None, None, name, name, name]
    true, known = env.simulator, master._tracker.env.simulator  # which has yet to see the last command's work
    master.act(env.observe(master.observation, team, ONLY), ONLY)
    assert recognised(master) == name
    np.testing.assert_allclose(known.games.memory[0], true.games.memory[0], atol=1e-2)
    np.testing.assert_array_equal(known.capture_field[0], true.capture_field[0][[team, 1 - team]])


def test_who_flies_as_nobody_known_does_is_a_stranger_to_the_end_and_meets_the_tactic():
    class Turncoat:
        def __init__(self):
            self.ring, self.steps = load("ring", CONFIG), 0
            self.observation, self.reset = self.ring.observation, self.ring.reset

        def act(self, observations, rows):
            self.steps += 1
            answer = self.ring.act(observations, rows)
            return answer if self.steps != 3 else np.ascontiguousarray(1.0 - answer)

    master = a_master()
    _, given = play(master, Turncoat(), RED, 7)
    corner = np.zeros((10, 10))
    corner[9, 0] = 1.0
    planned = [not np.array_equal(one[0], corner) for one in given]
    assert planned == [False, True, True, False, False, False, False]
    assert recognised(master) == "stranger" and master._met[0].predicted is None


@pytest.mark.parametrize("team", [RED, BLUE])
def test_the_tactic_is_shown_what_that_side_sees(team):
    tactic, seen = Tactic(), []
    master = a_master((), tactic)
    play(master, "noise", team, 4, 2, look=lambda env: seen.append(env.observe(tactic.observation, team)))
    assert tactic.begun == tactic.seeds == [0, 1] and len(tactic.shown) == 4
    np.testing.assert_array_equal(tactic.shown[-1], seen[-1])


@pytest.mark.parametrize(
    "rules",
    [{"command_period": 0.1}, {"drones_per_team": (39, 1)}, {"dynamics": DynamicsConfig(speed_factor=0.05)}],
    ids=str,
)
def test_whatever_the_rules_it_tells_known_ones_from_strangers(rules):
    config = CONFIG.replace(**rules)
    for name, found in (("ring", "ring"), ("noise", "stranger")):
        master = a_master(config=config)
        play(master, name, RED, 3, config=config)
        assert recognised(master) == found


def after(change, config=CONFIG):
    """Return whom a master recognises once the drones that it is shown were changed."""
    master = a_master(config=config)
    env, _ = play(master, "halo", RED, 1, config=config)
    drones = env.observe(master.observation, RED, ONLY)
    change(drones)
    master.act(drones, ONLY)
    return recognised(master)


def moved(who, way=0.004):
    def change(drones):
        own = drones[0, :, 4] > 0
        those = {"own": own, "opposing": ~own, "one": np.arange(len(own)) == 0, "all": own | True}[who]
        drones[0, those, :2] += np.where(drones[0, those, :2] > 0.5, -way, way).astype(np.float32)

    return change


def captured(drones):
    drones[0, -1, 4] = 1.0


@pytest.mark.parametrize(("period", "way"), [(1.0, 0.5), (0.5, 0.125), (3.0, 0.5)])
def test_how_near_is_near_goes_by_the_way_that_drones_make_in_a_command_period(period, way):
    config = CONFIG.replace(command_period=period)
    assert after(moved("all", 0.5 * 0.004 * way), config) == "halo"
    assert after(moved("all", 2.0 * 0.004 * way), config) == "stranger"


def test_near_is_on_average_and_of_either_side_and_of_the_same_drones():
    changes = [moved("own"), moved("opposing"), captured, moved("one")]
    assert [after(change) for change in changes] == ["stranger"] * 3 + ["halo"]


def test_planning_leaves_alone_whom_it_follows_and_commands_in_force_are_held(monkeypatch):
    config = CONFIG.replace(capture=CaptureConfig(enabled=False))
    master = Master(config, Tactic(), ("wavefront",), SHORT)
    play(master, "wavefront", RED, 9, config=config)  # whose waves break after five commands
    assert master._met[0].number == 0
    monkeypatch.setattr(module, "search", lambda *_: np.zeros((10, 10)))
    config = CONFIG.replace(memory=MemoryConfig(controller=None, controller_forgotten_on=("sending",)))
    master = a_master(config=config)
    play(master, "halo", RED, 5, config=config)
    assert recognised(master) == "halo"


def test_each_game_is_searched_with_what_was_found_in_it_before_and_a_random_stream_of_its_own(monkeypatch):
    asked = []

    def search(lookahead, game, team, model, last, generator):
        assert (lookahead.candidates, team, model.name) == (5, RED, "uniform"), "by the settings, against whom it met"
        asked.append((last, generator.random()))
        return np.full((10, 10), -float(len(asked)))

    monkeypatch.setattr(module, "search", search)
    play(a_master(), "uniform", BLUE, 3, count=2)
    assert [None if last is None else last[0, 0] for last, _ in asked] == [None, None, -1.0, -2.0]
    assert [drawn for _, drawn in asked[:2]] == [np.random.default_rng(seed).random() for seed in range(2)]


def test_a_game_depends_on_no_other():
    met = {16: "ring", 2: "noise", 0: "halo"}

    def answers(*rows):
        env, places, sides = BatchEnv(CONFIG, 17), np.array(rows), np.full(len(rows), RED)
        master = Master(CONFIG, "noise", KNOWN, SHORT)
        opponents = {row: load(met[row], CONFIG) for row in rows}
        env.reset(range(17))
        master.reset(rows, places)
        for row, opponent in opponents.items():
            opponent.reset([50], np.array([row]))
        given = []
        for _ in range(4):
            commands = np.ones((17, 2, 10, 10))
            commands[places, RED] = env.ask(master, sides, places)
            for row, opponent in opponents.items():
                commands[row, BLUE] = env.ask(opponent, np.array([BLUE]), np.array([row]))[0]
            given.append(commands[places, RED])
            env.step(commands)
        return np.stack(given, axis=1)

    np.testing.assert_array_equal(answers(*met), np.concatenate([answers(row) for row in met]))


def test_a_new_game_owes_nothing_to_the_one_before_and_leaves_others_as_they_are():
    master = a_master()
    play(master, "noise", RED, 3)
    assert recognised(master) == "stranger"
    _, again = play(master, "uniform", RED, 3)
    assert recognised(master) == "uniform"
    _, fresh = play(a_master(), "uniform", RED, 3)
    np.testing.assert_array_equal(again, fresh)
    env, _ = play(master, "ring", RED, 3, count=2)
    env.reset([9], np.array([1]))
    master.reset([9], np.array([1]))
    env.ask(master, np.zeros(2, int), np.arange(2))
    assert (recognised(master, 0), recognised(master, 1)) == ("ring", None)


def test_drones_that_cannot_be_are_refused_and_the_game_is_still_known():
    master = a_master()
    env, _ = play(master, "ring", RED, 3)
    seen = env.observe(master.observation, RED, ONLY)
    wrong_values = [(column, value) for column in range(5) for value in (np.nan, np.inf)]
    for column, value in (*wrong_values, (0, 1.1), (3, 1e30)):
        wrong = seen.copy()
        wrong[0, 0, column] = value
        with pytest.raises(PolicyError, match="observed drones must be in the square"):
            master.act(wrong, ONLY)
    for wrong in (seen[:, :-1], seen[..., :4], seen[:0]):
        with pytest.raises(PolicyError, match=r"must be of shape \(1, 10, 5\), got"):
            master.act(wrong, ONLY)
    master.act(seen, ONLY)
    assert recognised(master) == "ring"
    assert master.act(seen[:0], ONLY[:0]).shape == (0, 10, 10)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("planner:ring",), "plays by what it sees, got planner:ring"),
        (("ring", "ring"), "known must be"),
        (("ring", ("hold",)), "known must be"),
        (("ring", KNOWN, PlannerConfig(milliseconds=5.0)), "not for milliseconds"),
    ],
)
def test_what_it_cannot_know_or_do_is_refused(given, message):
    with pytest.raises(PolicyError, match=message):
        Master(CONFIG, *given)


def test_where_systems_fly_that_are_not_of_the_kernels_it_recognises_nobody():
    config, tactic = CONFIG.replace(controllers="flocking"), Tactic()
    master, env = a_master(tactic=tactic, config=config), BatchEnv(config)
    env.reset([0])
    master.reset([0], ONLY)
    for _ in range(3):
        commands = env.ask(master, ONLY, ONLY)
        env.step_checked(np.stack([commands, commands], axis=1))
    assert len(tactic.shown) == 3 and master._known == []
    config = CONFIG.replace(controllers=("direct", "ergodic"), time_limit=3.0)
    assert play_match("hold", "master", games=2, config=config).summary()["draws"] == 2


def test_it_beats_known_ones_within_seconds_and_strangers_as_its_tactic_does():
    config = GameConfig(time_limit=120.0)
    master = policies.load("master", config)
    known = play_match(master, "uniform", games=2, config=config).summary()
    assert known["wins"] == 2 and known["restricted_mean_seconds"] < 30
    assert play_match(master, "noise", games=2, config=config).summary()["wins"] == 2
