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
from swarm_pz.policies.lookahead import Lookahead
from swarm_pz.policies.master import Master
from swarm_pz.policies.planner import PlannerConfig, known_tactics
from swarm_pz.policy import Policy, PrivilegedPolicy, load

CONFIG = GameConfig(drones_per_team=5, time_limit=60.0)
SHORT = PlannerConfig(drone_steps=2_000, horizon=2.0)
KNOWN = ("ring", "uniform", "halo")


class Tactic:
    """What strangers meet: keeps what it was shown, and asks for one corner."""

    observation = ObservationConfig(channels=("own_positions", "opposing_positions", "own_target", "time_left"))

    def __init__(self):
        self.shown, self.begun, self.seeds = [], [], []

    def reset(self, seeds, rows):
        self.begun += rows.tolist()
        self.seeds += seeds

    def act(self, observations, rows):
        self.shown.append((observations, rows.tolist()))
        corner = np.zeros((len(rows), 10, 10))
        corner[:, 9, 0] = 1.0
        return corner


def a_master(known=KNOWN, tactic=None):
    return Master(CONFIG, tactic or Tactic(), known, SHORT)


def play(master, opponent, team, steps, count=1, config=CONFIG):
    """Play some commands; return the environment, and what the master gave each time."""
    env, rows, given = BatchEnv(config, count), np.arange(count), []
    env.reset(range(count))
    master.reset(list(range(count)), rows)
    opponent.reset([50 + row for row in range(count)], rows)
    for _ in range(steps):
        commands = np.empty((count, 2, 10, 10))
        commands[:, team] = env.ask(master, np.full(count, team), rows)
        commands[:, 1 - team] = env.ask(opponent, np.full(count, 1 - team), rows)
        given.append(commands[:, team].copy())
        env.step(commands)
    return env, given


def recognised(master, row=0):
    """Return whom a master takes its opponent for."""
    number = master._met[row].number
    return None if number is None else KNOWN[number]


def test_it_sees_drones_and_no_more():
    master = policies.load("master", CONFIG)
    assert isinstance(master, Policy) and not isinstance(master, PrivilegedPolicy)
    assert (master.name, master.answers, master.observation.kind) == ("master", "density", "drones")
    assert master.plays_as == "veteran"
    assert [policy.name for policy in master._known] == known_tactics()
    assert {"veteran", "champion", "uniform", "corners"} <= set(known_tactics())
    assert len({master.digest, policies.load("master", CONFIG).digest}) == 1
    assert master.digest != Master(CONFIG, load("champion", CONFIG)).digest, "other weights, another player"
    assert master.digest != Master(CONFIG, settings=SHORT).digest, "other plans, another player"
    assert Master(CONFIG, "ring").digest != Master(CONFIG, "halo").digest, "another script, another player"
    assert a_master(("ring", "uniform")).digest != a_master(("ring", "halo")).digest, "it knows others"
    assert Master(CONFIG, "champion").plays_as == "champion" and a_master().plays_as == ""
    folder = Path(zoo.__file__).parent / "hunter"
    assert Master(CONFIG, folder).plays_as == str(folder)


def test_other_weights_of_whom_it_knows_make_another_player(monkeypatch):
    def loaded(name, config):
        policy = load(name, config)
        if name == "hunter":
            policy.digest = "retrained"
        return policy

    before = a_master(("ring", "hunter")).digest
    assert before == a_master(("ring", "hunter")).digest
    monkeypatch.setattr(module, "load", loaded)
    assert a_master(("ring", "hunter")).digest != before


@pytest.mark.parametrize("team", [RED, BLUE])
@pytest.mark.parametrize("name", KNOWN)
def test_it_knows_after_one_command_whom_it_meets_and_for_as_long_as_that_is_so(name, team):
    master = a_master()
    play(master, load(name, CONFIG), team, 1)
    assert recognised(master) is None, "nothing was seen yet"
    for steps in (2, 6):
        env, _ = play(master, load(name, CONFIG), team, steps)
        assert recognised(master) == name
    order, rows = [team, 1 - team], np.zeros(1, int)
    true, known = env.simulator, master._tracker.env.simulator  # which has yet to see the last command's work
    master.act(env.observe(master.observation, team, rows), rows)
    assert recognised(master) == name
    np.testing.assert_allclose(known.games.memory[0], true.games.memory[0], atol=1e-2)
    np.testing.assert_array_equal(known.capture_field[0], true.capture_field[0][order])


def test_who_flies_as_nobody_known_does_is_a_stranger_to_the_end_and_meets_the_tactic():
    class Turncoat:
        observation = ObservationConfig()
        steps = 0

        def __init__(self):
            self.ring = load("ring", CONFIG)
            self.observation = self.ring.observation

        def reset(self, seeds, rows):
            self.ring.reset(seeds, rows)

        def act(self, observations, rows):
            self.steps += 1
            answer = self.ring.act(observations, rows)
            return answer if self.steps != 3 else np.ascontiguousarray(1.0 - answer)

    tactic = Tactic()
    master = a_master(tactic=tactic)
    _, given = play(master, Turncoat(), RED, 7)
    corner = np.zeros((10, 10))
    corner[9, 0] = 1.0
    planned = [not np.array_equal(one[0], corner) for one in given]
    assert planned == [False, True, True, False, False, False, False]
    assert master._met[0].is_stranger and master._met[0].predicted is None


@pytest.mark.parametrize("team", [RED, BLUE])
def test_the_tactic_is_shown_what_that_side_sees(team):
    tactic = Tactic()
    play(a_master(known=(), tactic=tactic), load("noise", CONFIG), team, 4, count=2)
    assert tactic.begun == tactic.seeds == [0, 1] and [rows for _, rows in tactic.shown] == 4 * [[0, 1]]
    shown, rows = tactic.shown[-1][0].astype(int), np.arange(2)
    back = BatchEnv(CONFIG, 2)
    back.reset(range(2))
    master, opponent = a_master(known=()), load("noise", CONFIG)
    opponent.reset([50, 51], rows)
    master.reset([0, 1], rows)
    for _ in range(3):
        commands = np.empty((2, 2, 10, 10))
        commands[:, team] = back.ask(master, np.full(2, team), rows)
        commands[:, 1 - team] = back.ask(opponent, np.full(2, 1 - team), rows)
        back.step(commands)
    np.testing.assert_array_equal(shown, back.observe(tactic.observation, team))


def test_it_plans_against_whom_it_knows(monkeypatch):
    asked = []
    tried = Lookahead.try_out

    def try_out(self, game, team, candidates, model):
        asked.append((team, model.name))
        return tried(self, game, team, candidates, model)

    monkeypatch.setattr(Lookahead, "try_out", try_out)
    master = a_master()
    assert (master._lookahead.candidates, master._lookahead.rounds) == (10, 1)
    play(master, load("halo", CONFIG), BLUE, 3)
    assert asked == 2 * [(RED, "halo")]


@pytest.mark.parametrize("command_period", [0.1, 0.5, 2.0])
def test_however_long_a_command_is_held_it_tells_known_ones_from_strangers(command_period):
    config = CONFIG.replace(command_period=command_period)
    for name, is_stranger in (("ring", False), ("noise", True)):
        master = Master(config, Tactic(), KNOWN, SHORT)
        play(master, load(name, config), RED, 3, config=config)
        assert master._met[0].is_stranger == is_stranger
        assert recognised(master) == (None if is_stranger else name)


@pytest.mark.parametrize("rules", [{"drones_per_team": (39, 1)}, {"dynamics": DynamicsConfig(speed_factor=0.05)}])
def test_a_stranger_is_one_though_few_drones_or_slow_ones_tell(rules):
    config = CONFIG.replace(**rules)
    master = Master(config, Tactic(), KNOWN, SHORT)
    play(master, load("noise", config), RED, 2, config=config)
    assert master._met[0].is_stranger


@pytest.mark.parametrize(
    ("rules", "way"), [({}, 0.5), ({"command_period": 0.5}, 0.125), ({"command_period": 3.0}, 0.5)]
)
def test_how_near_is_near_goes_by_the_way_that_drones_make_in_a_command_period(rules, way):
    config = CONFIG.replace(**rules)
    for share, is_stranger in ((0.5, False), (2.0, True)):
        master, rows = Master(config, Tactic(), KNOWN, SHORT), np.zeros(1, int)
        env, _ = play(master, load("halo", config), RED, 1, config=config)
        drones = env.observe(master.observation, RED, rows)
        drones[:, :, :2] += np.float32(share * 0.004 * way)
        master.act(drones, rows)
        assert master._met[0].is_stranger == is_stranger


def test_who_has_other_drones_than_predicted_is_a_stranger():
    master, rows = a_master(), np.zeros(1, int)
    env, _ = play(master, load("halo", CONFIG), RED, 2)
    drones = env.observe(master.observation, RED, rows)
    drones[0, -1, 4] = 1.0
    master.act(drones, rows)
    assert master._met[0].is_stranger


def test_planning_leaves_alone_whom_it_follows():
    config = CONFIG.replace(capture=CaptureConfig(enabled=False))
    master = Master(config, Tactic(), ("wavefront",), SHORT)
    play(master, load("wavefront", config), RED, 9, config=config)  # whose waves break after five commands
    assert master._met[0].number == 0


def test_each_game_is_searched_with_what_was_found_in_it_before_and_a_random_stream_of_its_own(monkeypatch):
    asked = []

    def search(lookahead, game, team, model, last, generator):
        asked.append((last, generator.random()))
        return np.full((10, 10), -float(len(asked)))

    monkeypatch.setattr(module, "search", search)
    play(a_master(), load("uniform", CONFIG), RED, 3, count=2)
    found = [None if last is None else last[0, 0] for last, _ in asked]
    assert found == [None, None, -1.0, -2.0]
    assert [drawn for _, drawn in asked[:2]] == [np.random.default_rng(seed).random() for seed in range(2)]


def test_who_sends_the_same_again_holds_it_and_so_it_is_predicted(monkeypatch):
    monkeypatch.setattr(module, "search", lambda *_: np.zeros((10, 10)))
    config = CONFIG.replace(memory=MemoryConfig(controller=None, controller_forgotten_on=("sending",)))
    master = Master(config, Tactic(), KNOWN, SHORT)
    play(master, load("halo", config), RED, 5, config=config)
    assert recognised(master) == "halo"


@pytest.mark.parametrize("tactic", ["veteran", "noise"])
def test_a_game_depends_on_no_other(tactic):
    met = {16: "ring", 2: "noise", 0: "halo"}

    def answers(*rows):
        env, places, sides = BatchEnv(CONFIG, 17), np.array(rows), np.full(len(rows), RED)
        master = Master(CONFIG, tactic, KNOWN, SHORT)
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


def test_a_new_game_owes_nothing_to_the_one_before():
    master = a_master()
    play(master, load("noise", CONFIG), RED, 3)
    assert master._met[0].is_stranger
    _, again = play(master, load("uniform", CONFIG), RED, 3)
    assert recognised(master) == "uniform"
    _, fresh = play(a_master(), load("uniform", CONFIG), RED, 3)
    np.testing.assert_array_equal(again, fresh)


def test_a_game_that_begins_anew_leaves_others_as_they_are():
    master, opponent, one = a_master(), load("ring", CONFIG), np.array([1])
    env, _ = play(master, opponent, RED, 3, count=2)
    env.reset([9], one)
    master.reset([9], one)
    env.ask(master, np.zeros(2, int), np.arange(2))
    assert recognised(master, 0) == "ring" and recognised(master, 1) is None


@pytest.mark.parametrize(("who", "is_stranger"), [("own", True), ("opposing", True), ("one", False)])
def test_near_is_on_average_and_of_either_side(who, is_stranger):
    master, rows = a_master(), np.zeros(1, int)
    env, _ = play(master, load("halo", CONFIG), RED, 1)
    drones = env.observe(master.observation, RED, rows)
    own = drones[0, :, 4] > 0
    moved = {"own": own, "opposing": ~own, "one": np.arange(len(own)) == 0}[who]
    drones[0, moved, :2] += np.where(drones[0, moved, :2] > 0.5, -0.004, 0.004).astype(np.float32)  # near is 0.002
    master.act(drones, rows)
    assert master._met[0].is_stranger == is_stranger


def test_its_settings_reach_the_search(monkeypatch):
    given = []
    monkeypatch.setattr(module, "Lookahead", lambda *args: given.append(args))
    Master(CONFIG, Tactic(), KNOWN, PlannerConfig(drone_steps=7_000, horizon=1.5, promise=0.25))
    assert given == [(CONFIG, 1.5, 7_000, 0.25)]


def test_strangers_cannot_be_left_to_who_sees_the_simulator():
    with pytest.raises(PolicyError, match="strangers must meet a policy that plays by what it sees, got planner:ring"):
        Master(CONFIG, "planner:ring")
    with pytest.raises(PolicyError, match="there is no policy 'nobody'"):
        Master(CONFIG, "nobody")


@pytest.mark.parametrize("column", range(5))
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30])
def test_drones_that_cannot_be_are_refused_and_the_game_is_still_known(column, value):
    master, rows = a_master(), np.zeros(1, int)
    env, _ = play(master, load("ring", CONFIG), RED, 3)
    seen = env.observe(master.observation, RED, rows)
    wrong = seen.copy()
    wrong[0, 0, column] = value
    if (column, value) != (4, 1e30):  # a team is a sign
        with pytest.raises(PolicyError, match="observed drones must be in the square"):
            master.act(wrong, rows)
    for wrong in (seen[:, :-1], seen[..., :4], seen[:0]):
        with pytest.raises(PolicyError, match=r"must be of shape \(1, 10, 5\), got"):
            master.act(wrong, rows)
    master.act(seen, rows)
    assert recognised(master) == "ring"


def test_nobody_asks_and_nobody_is_answered():
    master = a_master()
    assert master.act(np.zeros((0, 10, 5), np.float32), np.zeros(0, int)).shape == (0, 10, 10)


def test_what_it_cannot_know_or_do_is_refused():
    for known in ("ring", ("hold",), ("ring", "lead_in")):
        with pytest.raises(PolicyError, match="known must be names of policies that answer densities"):
            Master(CONFIG, Tactic(), known, SHORT)
    with pytest.raises(PolicyError, match="drone_steps, not for milliseconds"):
        Master(CONFIG, Tactic(), KNOWN, PlannerConfig(milliseconds=5.0))


def test_where_systems_fly_that_are_not_of_the_kernels_it_recognises_nobody():
    config = CONFIG.replace(controllers="flocking")
    tactic = Tactic()
    master = Master(config, tactic, KNOWN, SHORT)
    assert master._known == []
    env, rows, sides = BatchEnv(config), np.zeros(1, int), np.zeros(1, int)
    env.reset([0])
    master.reset([0], rows)
    for _ in range(3):
        commands = env.ask(master, sides, rows)
        env.step_checked(np.stack([commands, commands], axis=1))
    assert len(tactic.shown) == 3


def test_it_meets_who_is_flown_by_a_system_that_takes_no_densities():
    config = CONFIG.replace(controllers=("direct", "ergodic"), time_limit=3.0)
    assert play_match("hold", "master", games=2, config=config).summary()["draws"] == 2


def test_it_beats_known_ones_within_seconds_and_strangers_as_its_tactic_does():
    config = GameConfig(time_limit=120.0)
    master = policies.load("master", config)
    known = play_match(master, "uniform", games=4, config=config).summary()
    assert known["wins"] == 4 and known["restricted_mean_seconds"] < 30
    strange = play_match(master, "noise", games=4, config=config).summary()
    assert strange["wins"] == 4
