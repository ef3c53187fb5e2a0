"""A live game: when commands count, what is refused, how it ends, and how robots move."""

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, CaptureConfig, GameConfig
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.play.game import Captured, InForce, LiveGame, TableConfig
from swarm_pz.simulator import Simulator


def corner(row, column):
    density = np.zeros((10, 10))
    density[row, column] = 1.0
    return density


def in_force(events):
    return [(event.tick, event.command.team, event.command.number) for event in events if isinstance(event, InForce)]


def test_a_command_comes_into_force_at_the_next_solve_and_holds():
    game = LiveGame(TableConfig(), seed=0)
    game.advance(4)
    game.submit(RED, 1, corner(0, 0))
    assert in_force(game.advance(2)) == []
    assert in_force(game.advance(1)) == [(6, RED, 1)]
    game.advance(300)
    np.testing.assert_array_equal(game.simulator.targets[0, RED], corner(0, 0))


def test_of_commands_that_come_too_soon_the_latest_waits():
    game = LiveGame(TableConfig(min_command_interval=0.5), seed=0)
    for number in range(1, 5):
        game.submit(RED, number, corner(number, 0))
        game.submit(BLUE, 10 * number, corner(0, number))
        events = game.advance(1)
    events = game.advance(30)
    assert in_force(events) == [(15, RED, 4), (15, BLUE, 40)]
    assert TableConfig(min_command_interval=0.34).interval_ticks == 12
    assert TableConfig(min_command_interval=0.0).interval_ticks == 0


def test_the_game_is_that_of_the_simulator():
    game, simulator = LiveGame(TableConfig(), seed=3), Simulator()
    simulator.reset([3])
    for step in range(10):
        for team in (RED, BLUE):
            game.submit(team, step, corner(5, (step + team) % 10))
            simulator.command(team, corner(5, (step + team) % 10)[None])
        events = game.advance(30)
        simulator.advance(30)
        assert all(isinstance(event, InForce | Captured) for event in events)
    np.testing.assert_array_equal(game.simulator.positions, simulator.positions)
    assert game.sizes == tuple(simulator.sizes[0])


def test_captures_are_told_with_their_tick():
    game = LiveGame(TableConfig(game=GameConfig(capture=CaptureConfig(threshold=0.5))), seed=1)
    captures = [event for event in game.advance(1200) if isinstance(event, Captured)]
    assert captures
    teams = np.repeat([RED, BLUE], 10)
    for event in captures:
        assert teams[event.drone] != event.team
        teams[event.drone] = event.team
    np.testing.assert_array_equal(teams, game.simulator.teams[0])


def test_a_game_ends_when_time_is_up_and_one_without_an_opponent_does_not():
    short = LiveGame(TableConfig(game=GameConfig(time_limit=1.0)), seed=0)
    assert short.outcome is None
    short.advance(100)
    assert short.over and short.tick == 30 and short.outcome == "draw"
    alone = LiveGame(TableConfig(game=GameConfig(drones_per_team=(10, 0), capture=CaptureConfig(enabled=False))), 0)
    alone.advance(60)
    assert not alone.over


def test_nonsense_is_refused_and_the_game_goes_on():
    game = LiveGame(TableConfig(), seed=0)
    game.submit(RED, 1, corner(0, 0))
    for team, density in ((RED, np.full((10, 10), np.nan)), (RED, np.ones((3, 3))), (2, np.ones((10, 10)))):
        with pytest.raises(CommandError):
            game.submit(team, 2, density)
    assert in_force(game.advance(1)) == [(0, RED, 1)]
    LiveGame(TableConfig(game=GameConfig(command_cells=5)), seed=0).submit(RED, 1, np.eye(5))
    released = GameConfig.preset("released")
    assert [TableConfig(game=game).mapping for game in (GameConfig(), released)] == ["firm", "paper"]
    assert TableConfig(game=released, mapping="firm").mapping == "firm"
    for wrong in ({"maping": "firm"}, {"mapping": "thin"}):
        with pytest.raises(ConfigError, match="mapping"):
            TableConfig(**wrong)


@pytest.mark.parametrize(("team", "outcome"), [(RED, "red"), (BLUE, "blue")])
def test_who_has_every_drone_has_won_even_as_time_runs_out(team, outcome):
    game = LiveGame(TableConfig(game=GameConfig(time_limit=1.0)), seed=0)
    game.advance(30)
    game.simulator.games.teams[:] = team
    assert game.outcome == outcome


@pytest.mark.parametrize("factor", [1.0, 1e-290])
def test_what_is_followed_is_what_a_recording_can_hold_however_faint_it_was(factor):
    game, density = LiveGame(TableConfig(), seed=0), np.linspace(0.0, 0.5, 100).reshape(10, 10)
    command = game.submit(BLUE, 7, factor * density)
    (event,) = game.advance()
    assert event.command is command and (command.team, command.number) == (BLUE, 7)
    np.testing.assert_array_equal(command.values, np.round(density / density.max(), 8))
    np.testing.assert_allclose(game.simulator.targets[0, BLUE], command.values / command.values.sum(), rtol=1e-12)
    assert not game.submit(RED, 1, np.zeros((10, 10))).values.any(), "one of nothing stays one of nothing"


@pytest.mark.parametrize(("name", "beyond"), [("speed", 0.09), ("speed", 11.0), ("min_command_interval", 66.0)])
def test_a_table_has_limits_of_speed_and_of_commands(name, beyond):
    with pytest.raises(ConfigError, match=name):
        TableConfig(**{name: beyond})


def test_a_command_at_the_table_is_sent_be_it_the_same_again():
    game = LiveGame(TableConfig(game=GameConfig.preset("released"), min_command_interval=0.0), seed=0)
    weights = []
    for number in range(3):
        game.submit(RED, number, corner(0, 0))
        game.advance(6)
        weights.append(game.simulator.games.memory_weight[0, [0, -1]].tolist())
    assert weights == [[2.0, 2.0], [2.0, 4.0], [2.0, 6.0]]


def test_who_asks_at_every_step_hands_in_only_what_is_not_held():
    def holds(game, team, density):
        return game.holds(game.reader.read(team, 0, density))

    evenly, aside = np.full((10, 10), 1 / 3), corner(0, 0)
    game = LiveGame(TableConfig(game=GameConfig.preset("released")), seed=0)
    assert holds(game, RED, evenly) and not holds(game, RED, aside)
    game.submit(RED, 1, aside)
    assert holds(game, RED, aside / 2) and not holds(game, RED, evenly), "the one that waits will be followed"
    assert holds(game, BLUE, evenly)
    game.advance(3)
    assert holds(game, RED, aside) and not holds(game, RED, evenly)
    # Where resending has no effect, every command is handed in and recorded.
    assert not holds(LiveGame(TableConfig(), seed=0), RED, evenly)


# --- robots ---------------------------------------------------------------------------------------


def poses_of(game, **moved):
    """Return poses of all drones at rest where they are; `moved` drones are elsewhere, or lost (None)."""
    poses = np.zeros((game.config.game.num_drones, 4), np.float32)
    poses[:, :2] = game.simulator.positions[0]
    for name, place in moved.items():
        poses[int(name[1:])] = np.nan if place is None else (*place, 0.0, 0.0)
    return poses


def test_robots_move_by_their_poses_alone_and_are_captured_where_they_are():
    game = LiveGame(TableConfig(game=GameConfig(drones_per_team=(16, 2))), seed=0, robots=True)
    angles = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    ring = {f"d{n}": (0.31 + 0.04 * np.cos(a), 0.31 + 0.04 * np.sin(a)) for n, a in enumerate(angles)}
    for _ in range(60):
        game.place(poses_of(game, **ring, d16=(0.9, 0.9), d17=(0.9, 0.1)))
        assert not [event for event in game.advance() if isinstance(event, Captured)]
        np.testing.assert_allclose(game.simulator.positions[0, 16], (0.9, 0.9), atol=1e-6)
    assert np.abs(game.simulator.games.accelerations[0]).max() > 0.1, "the control systems choose all the same"
    game.place(poses_of(game, d16=(0.31, 0.31)))
    assert [event.drone for event in game.advance() if isinstance(event, Captured)] == [16]


def test_a_lost_robot_stands_where_it_was_leaves_no_trail_and_comes_back():
    game = LiveGame(TableConfig(), seed=0, robots=True)
    game.place(poses_of(game, d0=(0.4, 0.6)))
    game.advance()
    before = game.simulator.occupancy[0].sum()
    for _ in range(6):
        game.place(poses_of(game, d0=None))
        game.advance()
    assert game.simulator.failed[0].tolist() == [True] + [False] * 19
    assert game.simulator.occupancy[0].sum() - before == 6 * 19
    np.testing.assert_allclose(game.simulator.positions[0, 0], (0.4, 0.6), atol=1e-6)
    assert not game.simulator.games.accelerations[0, 0].any()
    game.place(poses_of(game, d0=(0.5, 0.6)))
    game.advance(1)
    assert not game.simulator.failed[0].any() and game.simulator.positions[0, 0, 0] == 0.5
