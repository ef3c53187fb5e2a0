from __future__ import annotations

import pickle

import numpy as np
import pytest

from swarm_pz.cli.player_options import able
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.registry import registered, system_of
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import KindError
from swarm_pz.policies import commanders
from swarm_pz.policies.commanders import SCRIPTS, Commander, GameState, Script, hold
from swarm_pz.policy import load

SYSTEMS = {name: system_of(name) for name in sorted(registered())}
FLOWN = [(script, name) for script in SCRIPTS for name, one in SYSTEMS.items() if one.takes == script.answers]
DRONES = ObservationConfig(kind="drones")


def rules(system, **more):
    return GameConfig(drones_per_team=(3, 4), controllers=(system, "ergodic"), **more)


def state(own=(), opposing=(), velocities=None, numbers=None, step=0, system="direct"):
    own = np.array(own, float).reshape(-1, 2)
    return GameState(
        own=own,
        opposing=np.array(opposing, float).reshape(-1, 2),
        velocities=np.zeros_like(own) if velocities is None else np.array(velocities, float),
        numbers=np.arange(len(own)) if numbers is None else np.array(numbers),
        step=step,
        system=system_of(system),
        config=GameConfig(),
    )


@pytest.mark.parametrize(("script", "system"), [*FLOWN, *((hold, name) for name in SYSTEMS if name != "ergodic")])
def test_answers_are_of_the_systems_space_and_depend_on_no_other_game(script, system):
    assert pickle.loads(pickle.dumps(script)) is getattr(commanders, script.__name__) is script  # noqa: S301
    config, rows = rules(system), np.arange(2)
    batch = BatchEnv(config, 2)
    batch.reset(range(2))
    together, alone = (load(script.__name__, config) for _ in range(2))
    for policy in (together, alone):
        policy.reset([0, 1], rows)
    space, boards = config.team_systems[0].space(config), batch.observe(DRONES, 0)
    commands = together.act(boards, rows)
    np.testing.assert_array_equal(commands, [alone.act(boards[[row]], rows[[row]])[0] for row in rows])
    assert commands.shape == (2, *space.shape)
    assert (commands >= space.low - 1e-6).all() and (commands <= space.high + 1e-6).all()
    if script is not hold:  # without opponents, and without own drones
        for lonely in (state(own=[[0.2, 0.3]], system=system), state(opposing=[[0.2, 0.3]], system=system)):
            lonely.system.parse(script.play(lonely), lonely.config)


def test_scripts_play_for_their_kind_of_system_alone(capsys):
    with pytest.raises(KindError, match="'accelerations', but"):
        load("tighten", GameConfig())
    for flies, can, cannot in (("ergodic", "ring", "tighten"), ("direct", "tighten", "ring")):
        found = able(rules(flies))
        assert can in found and cannot not in found
    assert not capsys.readouterr().err


def test_hold_sends_what_the_system_of_its_team_does_by_itself():
    config = GameConfig(controllers=("direct", "ergodic"))
    first, second = (load("hold", config, system) for system in config.team_systems)
    assert (first.answers, second.answers) == ("accelerations", "density")
    for policy, expected in ((first, np.zeros((1, 20, 2))), (second, np.ones((1, 10, 10)))):
        policy.reset([0], np.arange(1))
        np.testing.assert_array_equal(policy.act(np.zeros((1, 20, 5), np.float32), np.arange(1)), expected)
    assert load(first, config) is first
    assert first.for_system(system_of("ergodic")).for_system(system_of("flocking")).answers == "attractors"


def test_a_commander_plays_its_own_drones_and_counts_the_steps_of_each_game():
    states = []

    def note(state):
        states.append(state)
        return state.system.default(state.config)

    policy = Commander(Script(note, "accelerations"), rules("direct", command_period=2.0))
    boards = np.zeros((2, 7, 5), np.float32)
    boards[:, :, :4] = np.random.default_rng(0).random((2, 7, 4))
    boards[:, :, 4] = [[1, -1, 1, 1, -1, -1, -1], [-1, 1, 1, -1, -1, -1, -1]]
    rows = np.array([3, 5])
    policy.reset([0, 1], rows)
    policy.act(boards, rows)
    policy.act(boards[1:], rows[1:])
    policy.reset([2], rows[:1])
    policy.act(boards, rows)
    assert [state.step for state in states] == [0, 0, 1, 0, 2] and states[-1].seconds == 4.0
    assert states[0].numbers.tolist() == [0, 2, 3]
    np.testing.assert_array_equal(states[0].own, boards[0, [0, 2, 3], :2].astype(float))
    np.testing.assert_array_equal(states[0].velocities, boards[0, [0, 2, 3], 2:4].astype(float))
    np.testing.assert_array_equal(states[0].opposing, boards[0, [1, 4, 5, 6], :2].astype(float))


def test_scripts_send_towards_the_weak_and_away_from_the_strong():
    alone, crowded = [0.1, 0.9], [0.8, 0.3]
    scene = state(own=[[0.5, 0.5]], opposing=[alone, crowded, [0.85, 0.3], [0.8, 0.35]], system="flocking")
    np.testing.assert_allclose(commanders.pounce.play(scene)[0], [0.8167, 0.3167, 100.0], atol=1e-4)
    np.testing.assert_allclose(commanders.pick_off.play(scene)[0], [*alone, 100.0])
    assert commanders.slip_away.play(scene)[0][2] == 75.0
    besieged = commanders.besiege.play(state(own=[], opposing=[[0.95, 0.5]] * 2, system="potential_field"))
    assert besieged[0, :, 5:].sum() > 2 * besieged[0, :, :5].sum() and not besieged[1].any(), "right of the middle"
    drawn, repelled = commanders.shun.play(state(opposing=[[0.1, 0.15]] * 3, system="potential_field"))
    assert drawn[9, 9] > 0.5 > drawn[1, 1] and repelled[1, 0] > 0.5 > repelled[9, 9]


def test_direct_scripts_push_away_or_towards_and_brake_and_command_their_own_rows():
    away = commanders.scatter.play(state(own=[[0.5, 0.5]], opposing=[[0.4, 0.5], [0.9, 0.9]]))
    assert away[0, 0] > 0.1 and away[0, 1] == pytest.approx(0.0)
    still, moving = (
        commanders.hem_in.play(state(own=[[0.5, 0.5]], opposing=[[0.5, 0.5]], velocities=[[speed, 0.0]]))[0, 0]
        for speed in (0.0, 0.2)
    )
    assert moving < still
    fast = [[3.0, 0.0], [0.0, 0.0]]
    scene = state(own=[[0.1, 0.1], [0.7, 0.6]], opposing=[[0.5, 0.5]], velocities=fast, numbers=[7, 2])
    for script in (commanders.tighten, commanders.hem_in, commanders.scatter):
        command = script.play(scene)
        assert set(np.flatnonzero(command.any(axis=1))) == {2, 7}
        assert np.hypot(*command.T).max() <= 1.0 + 1e-12


def test_what_a_game_state_tells_of_the_opponents():
    crowded = [[0.1, 0.1], [0.7, 0.7], [0.8, 0.7], [0.75, 0.85]]
    np.testing.assert_allclose(state(opposing=crowded).largest_cluster(), [0.75, 0.75])
    opposing = [[0.5, 0.5], [0.55, 0.5], [0.9, 0.1], [0.1, 0.9]]
    np.testing.assert_allclose(state(own=[[0.0, 1.0]], opposing=opposing).weakest(), [0.1, 0.9])
    np.testing.assert_allclose(state(own=[[0.5, 0.4]], opposing=opposing).weakest(), [0.9, 0.1])
    refuge = state(opposing=[[0.1, 0.1], [0.9, 0.9]]).refuge()
    assert sorted(refuge.tolist()) == pytest.approx([0.1, 0.9]), "from the nearest of them, not from the farthest"
    radii = [state(step=step).closing() for step in range(13)]
    assert radii[0] == radii[12] and np.all(np.diff(radii[:12]) < 0)
