from __future__ import annotations

import pickle

import numpy as np
import pytest

from swarm_pz.cli.player_options import able
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.registry import registered, system_of
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import KindError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies import commanders
from swarm_pz.policies.commanders import SCRIPTS, Commander, GameState, Script, hold
from swarm_pz.policy import load

SYSTEMS = {name: system_of(name) for name in sorted(registered())}
FLOWN = [(script, name) for script in SCRIPTS for name, one in SYSTEMS.items() if one.takes == script.answers]
DRONES = ObservationConfig(kind="drones")


def rules(system, **more):
    return GameConfig(drones_per_team=(3, 4), controllers=(system, "ergodic"), **more)


def board(own=(), opposing=(), velocities=None, numbers=None, step=0, system="direct"):
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


@pytest.mark.parametrize(("script", "system"), [*FLOWN, *((hold, name) for name in SYSTEMS)])
def test_every_script_plays_a_game_flown_by_a_system_of_its_kind(script, system):
    match = play_match(script.__name__, "uniform", games=2, config=rules(system, time_limit=4.0))
    assert len(match.games) == 2


@pytest.mark.parametrize(("script", "system"), FLOWN)
def test_answers_are_of_the_space_and_do_not_depend_on_the_batch(script, system):
    config = rules(system)
    batch = BatchEnv(config, 3)
    batch.reset(range(3))
    together, alone = (load(script.__name__, config) for _ in range(2))
    space, rows = config.team_systems[0].space(config), np.arange(3)
    for policy in (together, alone):
        policy.reset([0, 1, 2], rows)
    for _ in range(3):
        seen = batch.observe(DRONES, 0)
        commands = together.act(seen, rows)
        one_by_one = np.concatenate([alone.act(seen[row : row + 1], rows[row : row + 1]) for row in rows])
        np.testing.assert_array_equal(commands, one_by_one)
        assert commands.shape == (3, *space.shape)
        assert (commands >= space.low - 1e-6).all() and (commands <= space.high + 1e-6).all()
        batch.step((commands, [np.ones((10, 10))] * 3))


@pytest.mark.parametrize("script", SCRIPTS)
def test_every_script_knows_what_to_do_against_nobody_and_with_nobody(script):
    flying = [name for name, one in SYSTEMS.items() if one.takes == script.answers]
    for system in flying:
        for lonely in (board(own=[[0.2, 0.3]], system=system), board(opposing=[[0.2, 0.3]], system=system)):
            lonely.system.parse(script.play(lonely), lonely.config)


def test_scripts_are_pickled_by_name_and_have_a_line_about_them():
    for script in (*SCRIPTS, hold):
        assert pickle.loads(pickle.dumps(script)) is getattr(commanders, script.__name__) is script  # noqa: S301
        assert script.__doc__.splitlines()[0].endswith(".")


def test_a_script_cannot_command_a_team_of_another_system():
    with pytest.raises(KindError, match=r"'tighten' answers commands of kind 'accelerations', but .* ergodic takes"):
        load("tighten", GameConfig())


def test_who_can_play_is_told_without_a_word_about_those_for_other_systems(capsys):
    assert "tighten" not in able(GameConfig()) and "ring" in able(GameConfig())
    assert "tighten" in able(rules("direct")) and "ring" not in able(rules("direct"))
    assert not capsys.readouterr().err


def test_hold_sends_what_the_system_of_its_team_does_by_itself():
    config = GameConfig(controllers=("direct", "ergodic"))
    first, second = (load("hold", config, system) for system in config.team_systems)
    assert (first.answers, second.answers) == ("accelerations", "density")
    seen = np.zeros((1, 20, 5), np.float32)
    for policy in (first, second):
        policy.reset([0], np.arange(1))
    np.testing.assert_array_equal(first.act(seen, np.arange(1)), np.zeros((1, 20, 2)))
    np.testing.assert_array_equal(second.act(seen, np.arange(1)), np.ones((1, 10, 10)))
    assert load(first, config) is first


def test_a_commander_plays_its_own_drones_and_counts_the_steps_of_each_game():
    config = rules("direct", command_period=2.0)
    boards = []

    def note(board):
        boards.append(board)
        return board.system.default(board.config)

    policy = Commander(Script(note, "accelerations"), config)
    seen = np.zeros((2, 7, 5), np.float32)
    seen[:, :, :4] = np.random.default_rng(0).random((2, 7, 4))
    seen[:, :, 4] = [[1, -1, 1, 1, -1, -1, -1], [-1, 1, 1, -1, -1, -1, -1]]
    rows = np.array([3, 5])
    policy.reset([0, 1], rows)
    policy.act(seen, rows)
    policy.act(seen[1:], rows[1:])
    policy.reset([2], rows[:1])
    policy.act(seen, rows)
    assert [board.step for board in boards] == [0, 0, 1, 0, 2] and boards[-1].seconds == 4.0
    assert boards[0].numbers.tolist() == [0, 2, 3]
    np.testing.assert_array_equal(boards[0].own, seen[0, [0, 2, 3], :2].astype(float))
    np.testing.assert_array_equal(boards[0].velocities, seen[0, [0, 2, 3], 2:4].astype(float))
    np.testing.assert_array_equal(boards[0].opposing, seen[0, [1, 4, 5, 6], :2].astype(float))
    other = policy.for_system(system_of("ergodic")).for_system(system_of("flocking"))
    assert other.answers == "attractors"


def test_scripts_send_towards_the_weak_and_away_from_the_strong():
    alone, crowded = [0.1, 0.9], [0.8, 0.3]
    seen = {"own": [[0.5, 0.5]], "opposing": [alone, crowded, [0.85, 0.3], [0.8, 0.35]]}
    attractors = {
        script: script.play(board(**seen, system="flocking"))[0]
        for script in (commanders.pounce, commanders.pick_off, commanders.slip_away)
    }
    np.testing.assert_allclose(attractors[commanders.pounce], [0.8167, 0.3167, 100.0], atol=1e-4)
    np.testing.assert_allclose(attractors[commanders.pick_off], [*alone, 100.0])
    assert attractors[commanders.slip_away][2] == 75.0
    besieged = commanders.besiege.play(board(own=[], opposing=[[0.95, 0.5]] * 2, system="potential_field"))
    assert besieged[0, :, 5:].sum() > 2 * besieged[0, :, :5].sum() and not besieged[1].any(), "right of the middle"
    drawn, repelled = commanders.shun.play(board(opposing=[[0.1, 0.15]] * 3, system="potential_field"))
    assert drawn[9, 9] > 0.5 > drawn[1, 1] and repelled[1, 0] > 0.5 > repelled[9, 9]


def test_direct_scripts_push_away_or_towards_and_brake():
    away = commanders.scatter.play(board(own=[[0.5, 0.5]], opposing=[[0.4, 0.5], [0.9, 0.9]]))
    assert away[0, 0] > 0.1 and away[0, 1] == pytest.approx(0.0)
    still, moving = (
        commanders.hem_in.play(board(own=[[0.5, 0.5]], opposing=[[0.5, 0.5]], velocities=[[speed, 0.0]]))[0, 0]
        for speed in (0.0, 0.2)
    )
    assert moving < still


def test_the_crowd_is_the_middle_of_the_largest_cluster():
    np.testing.assert_allclose(board(opposing=[[0.1, 0.1], [0.7, 0.7], [0.8, 0.7], [0.75, 0.85]]).crowd(), [0.75, 0.75])


def test_the_weakest_has_the_fewest_beside_it_and_is_the_nearest_of_these():
    seen = board(own=[[0.0, 1.0]], opposing=[[0.5, 0.5], [0.55, 0.5], [0.9, 0.1], [0.1, 0.9]])
    np.testing.assert_allclose(seen.weakest(), [0.1, 0.9])
    seen = board(own=[[0.5, 0.4]], opposing=[[0.5, 0.5], [0.55, 0.5], [0.9, 0.1], [0.1, 0.9]])
    np.testing.assert_allclose(seen.weakest(), [0.9, 0.1], err_msg="not those that have each other")


def test_the_refuge_is_far_from_everybody():
    np.testing.assert_allclose(board(opposing=[[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]]).refuge(), [0.9, 0.9], atol=0.05)
    refuge = board(opposing=[[0.1, 0.1], [0.9, 0.9]]).refuge()
    assert sorted(refuge.tolist()) == pytest.approx([0.1, 0.9]), "from the nearest of them, not from the farthest"


def test_a_ring_closes_and_opens_again():
    radii = [board(step=step).closing() for step in range(13)]
    assert radii[0] == radii[12] and np.all(np.diff(radii[:12]) < 0)


def test_direct_commands_stand_in_the_rows_of_the_own_drones_and_are_not_too_long():
    seen = board(
        own=[[0.1, 0.1], [0.7, 0.6]], opposing=[[0.5, 0.5]], velocities=[[3.0, 0.0], [0.0, 0.0]], numbers=[7, 2]
    )
    for script in (commanders.tighten, commanders.hem_in, commanders.scatter):
        command = script.play(seen)
        assert set(np.flatnonzero(command.any(axis=1))) == {2, 7}
        assert np.hypot(*command.T).max() <= 1.0 + 1e-12


def test_drones_of_a_board_stand_in_the_rows_of_their_numbers():
    config = GameConfig(drones_per_team=(1, 2))
    batch = BatchEnv(config, 1)
    batch.reset([0], scenario={"positions": [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]], "teams": [0, 1, 1]})
    np.testing.assert_allclose(batch.observe(DRONES, 0)[0, :, :2], [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]], rtol=1e-6)
    np.testing.assert_array_equal(batch.observe(DRONES, 0)[0, :, 4], [1, -1, -1])
    np.testing.assert_array_equal(batch.observe(DRONES, 1)[0, :, 4], [-1, 1, 1])
    assert config.replace(observation=DRONES).observation == DRONES
