"""Observations of drones against a slow version, and their actions."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz import GameConfig, ObservationConfig, Simulator
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.spaces import DIRECTIONS
from swarm_pz.spaces.drones import GROUND, DroneActions, DroneView
from swarm_pz.spaces.observation import observe


def slowly(view, grid, simulator, game, team):
    """Return the drones' observations, part by part in NumPy's float32; only `team` is active, or both if it is -1."""
    games, one, parts = simulator.games, np.float32(1), {}
    speed = np.float32(np.sqrt(2 * simulator.config.controller.max_acceleration))
    places, velocities, teams = games.positions[game], games.velocities[game], games.teams[game]
    observed = np.zeros((len(teams), *view.space.shape), np.float32)
    for drone in range(len(teams)):
        own = int(teams[drone])
        if games.failed[game, drone] or team not in (-1, own):
            observed[drone, 0] = -1
            continue
        (x, y), patch = places[drone], view.parts["ground"][1][-1]
        itself = [one, 2 * x - 1, 2 * y - 1, *np.clip(velocities[drone] / speed, -1, 1), x, 1 - x, y, 1 - y]
        parts["self"] = np.array([*itself, (teams == own).mean(dtype=np.float32)])
        for name, side in (("own", own), ("opposing", 1 - own)):
            others = np.array([other for other in np.flatnonzero(teams == side) if other != drone], np.int64)
            away = places[others] - places[drone]
            order = np.argsort(away[:, 0] ** 2 + away[:, 1] ** 2, kind="stable")[: view.parts[name][1][0]]
            parts[name] = np.zeros(view.parts[name][1], np.float32)
            speeds = np.clip((velocities[others] - velocities[drone]) / (2 * speed), -1, 1)
            parts[name][: len(order)] = np.hstack([np.ones((len(order), 1)), away[order], speeds[order]])
        images = ObservationConfig(grid=grid, channels=GROUND)
        (image,) = observe(simulator, images, np.array([own]), np.array([game]))
        framed = np.pad(image, ((0, 0), (patch // 2,) * 2, (patch // 2,) * 2))
        column, row = np.minimum((places[drone].astype(float) * 50).astype(int), 49) // (50 // grid)
        parts["ground"] = framed[:, row : row + patch, column : column + patch] / np.float32(255)
        filled = np.concatenate([part.ravel() for part in parts.values()])  # the parts leave no gaps
        assert all(np.array_equal(filled[where], parts[name].ravel()) for name, (where, _) in view.parts.items())
        observed[drone] = filled
    return observed


@pytest.mark.parametrize(("neighbours", "grid", "patch"), [(5, 10, 5), (1, 50, 3), (30, 5, 13)])
def test_drones_see_to_the_last_bit_what_a_slow_version_says(neighbours, grid, patch):
    """Catches a kernel that rounds or orders equally near drones differently, or crops the ground elsewhere."""
    config = GameConfig(drones_per_team=(7, 5), controllers="direct")
    simulator, generator = Simulator(config, num_games=2), np.random.default_rng(0)
    view = DroneView(config, neighbours=neighbours, grid=grid, patch=patch)
    simulator.reset([0, 1])
    places = generator.integers(0, 11, (2, 12, 2)) / 10  # some on walls, and many equally far
    for _ in range(5):
        for team in range(2):
            simulator.command(team, generator.uniform(-1, 1, (2, 12, 2)))
        simulator.advance(60)
    games = simulator.games
    games.positions[:], games.velocities[:] = places, generator.normal(size=(2, 12, 2))
    games.teams[:] = generator.integers(0, 2, (2, 12))
    simulator.games.failed[:] = generator.random((2, 12)) < 0.2
    for teams in ([0, 1], [1, 0], [-1, -1]):
        together = view.observe(simulator, np.array(teams), np.arange(2))
        for game, team in enumerate(teams):
            np.testing.assert_array_equal(together[game], slowly(view, grid, simulator, game, team))


def test_views_and_actions_that_make_no_sense_are_refused():
    for options, message in (({"neighbours": 0}, "neighbours"), ({"grid": 7}, "divisor of 50"), ({"patch": 4}, "odd")):
        with pytest.raises(ConfigError, match=message):
            DroneView(GameConfig(), **options)
    with pytest.raises(ConfigError, match="action must be 'acceleration' or 'discrete', got 'thrust'"):
        DroneActions("thrust")


def test_discrete_actions_are_the_nine_directions_at_full_acceleration():
    actions = DroneActions("discrete")
    assert actions.space.n == 9 == len(DIRECTIONS)
    read = actions.read(np.arange(9), (9,), "actions")
    assert np.linalg.norm(read, axis=1) == pytest.approx([0] + [1] * 8)
    angles = np.unwrap(np.arctan2(read[1:, 1], read[1:, 0]))
    assert np.diff(angles) == pytest.approx(np.full(7, np.pi / 4))
    assert actions.read(np.int64(3), (), "one").tolist() == [0, 1]


@pytest.mark.parametrize(
    ("kind", "given"),
    [*(("discrete", bad) for bad in (9, -1, 1.0, [1], None, "north", np.nan, [[1, 2], [3]])),
     *(("acceleration", bad) for bad in ([np.nan, 0], [2, 0], [0], "north", None))],
)  # fmt: skip
def test_what_is_no_action_is_refused_with_the_directions(kind, given):
    message = r"\[0, 9\).*north-west" if kind == "discrete" else r"of shape \(2,\)"
    with pytest.raises(CommandError, match=f"drone's action .*{message}"):
        DroneActions(kind).read(given, (), "drone's action")
