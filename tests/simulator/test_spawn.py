from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig, SpawnConfig
from swarm_pz.errors import CommandError
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.spawn import check_seed, next_seed


@pytest.mark.parametrize(("inset", "radius"), [(0.1, 0.08), (0.3, 0.2)])
def test_drones_start_evenly_within_a_radius_of_corner_points(inset, radius):
    config = GameConfig(drones_per_team=(4, 16), spawn=SpawnConfig(inset=inset, radius=radius))
    simulator = Simulator(config, num_games=100)
    simulator.reset(range(100))
    places = simulator.positions.reshape(-1, 2).astype(float)
    corners = np.where(places > 0.5, 1.0 - inset, inset)
    steps = places - corners
    distance = np.linalg.norm(steps, axis=1)
    assert distance.max() <= radius + 1e-6
    # A quarter of a disc lies within half of its radius, and as much on each side of its centre.
    assert (distance < radius / 2).mean() == pytest.approx(0.25, abs=0.04)
    assert (steps > 0).mean(axis=0) == pytest.approx([0.5, 0.5], abs=0.04)
    for corner in np.unique(corners, axis=0):
        assert (corners == corner).all(axis=1).mean() == pytest.approx(0.25, abs=0.04)
    # Of both teams alike: 0.5 is the chance of either half.
    assert (simulator.positions[:, :4] > 0.5).mean() == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize("layout", ["corners", "squares"])
def test_drones_may_start_moving_from_the_same_places(layout):
    started = {}
    for speed in (0.0, 0.2, 0.4):
        config = GameConfig(drones_per_team=(8, 12), spawn=SpawnConfig(layout=layout, speed=speed))
        started[speed] = Simulator(config, num_games=100)
        started[speed].reset(range(100))
        for name in ("positions", "altitudes", "seeds"):
            np.testing.assert_array_equal(getattr(started[speed].games, name), getattr(started[0.0].games, name))
    assert started[0.0].velocities.tobytes() == bytes(started[0.0].velocities.nbytes), "at rest"
    velocities = started[0.2].velocities
    np.testing.assert_allclose(started[0.4].velocities, 2.0 * velocities)
    for along in (velocities[:, :8].reshape(-1, 2), -velocities[:, 8:].reshape(-1, 2)):
        # Uniform: ends, mean and standard deviation on both axes, each axis by itself.
        assert along.min() >= 0.0 and along.max() <= 0.2
        np.testing.assert_allclose(along.mean(axis=0), 0.1, atol=0.01)
        np.testing.assert_allclose(along.std(axis=0), 0.2 / np.sqrt(12), rtol=0.1)
        assert abs(np.corrcoef(along.T)[0, 1]) < 0.15


@pytest.mark.parametrize(
    ("layout", "places", "luck"),
    [
        ("corners", [[0.96976757, 0.91836888], [0.97601885, 0.10792277]], 13456836363123071557),
        ("squares", [[0.16369617, 0.12697867], [0.89590263, 0.89834726]], 16837368535893154894),
    ],
)
def test_a_seed_always_gives_the_same_start_and_the_same_luck(layout, places, luck):
    simulator = Simulator(GameConfig(drones_per_team=1, spawn=SpawnConfig(layout=layout)), num_games=2)
    simulator.reset([1, 0])
    np.testing.assert_allclose(simulator.positions[1], places, atol=1e-6)
    assert simulator.games.seeds[1] == luck != simulator.games.seeds[0]


def test_altitudes_are_all_levels_up_to_one_in_another_order_in_every_game():
    simulator = Simulator(GameConfig(drones_per_team=(3, 5)), num_games=8)
    simulator.reset(range(8))
    np.testing.assert_allclose(np.sort(simulator.altitudes, axis=1), np.tile(np.arange(1, 9) / 8, (8, 1)))
    assert len({altitudes.tobytes() for altitudes in simulator.altitudes}) == 8


def test_a_seed_is_a_whole_number_or_what_numpy_makes_of_it():
    for seed in (0, 5, 2**70, np.int64(5)):
        assert check_seed(seed).entropy == seed
    assert check_seed(np.random.SeedSequence(5)).entropy == 5
    for bad in (-1, np.int64(-1), 0.0, True, None, "0", np.random.default_rng(0)):
        with pytest.raises(CommandError, match=r"a seed must be a whole number of at least 0 or a SeedSequence"):
            check_seed(bad)


def test_the_seeds_of_a_sequence_are_the_children_of_its_seed_in_turn_and_a_generator_needs_one():
    generator = np.random.default_rng(7)
    drawn = [next_seed(generator).generate_state(2).tolist() for _ in range(3)]
    assert drawn == [child.generate_state(2).tolist() for child in np.random.SeedSequence(7).spawn(3)]

    class Odd(np.random.PCG64):
        seed_seq = None

    with pytest.raises(CommandError, match="SeedSequence"):
        next_seed(np.random.Generator(Odd()))


def test_a_scenario_takes_the_place_of_what_it_names_and_of_nothing_else():
    simulator = Simulator(GameConfig(drones_per_team=2), num_games=2)
    simulator.reset([3, 4])
    drawn = simulator.snapshot()
    for name, values in (
        ("velocities", [[-10.0, 10.0], [0.0, -0.5], [0.25, 0.0], [1.0, 2.0]]),
        ("teams", [1, 0, 0, 1]),
        ("teams", np.array([True, False, True, True])),
        ("positions", np.tile([0.0, 1.0], (4, 1))),
    ):
        simulator.reset([3, 4], scenario={name: values})
        expected = drawn._replace(**{name: np.broadcast_to(values, getattr(drawn, name).shape)})
        for field, array, then in zip(drawn._fields, simulator.games, expected, strict=True):
            np.testing.assert_array_equal(array, then, err_msg=field)


@pytest.mark.parametrize(
    ("scenario", "message"),
    [
        ({"velocities": np.full((4, 2), 10.1)}, r"velocities must be numbers in \[-10, 10\] of shape \(4, 2\)"),
        ({"velocities": np.full((4, 2), -10.1)}, "scenario velocities"),
        ({"positions": np.full((4, 2), -0.1)}, r"scenario positions must be numbers in \[0, 1\]"),
        ({"teams": [0, 1, 0.5, 1]}, r"scenario teams must be 4 numbers that are 0 \(red\) or 1 \(blue\), got"),
        ({"teams": [0, 1, 0]}, "scenario teams"),
        ({"teams": [1, 1, 1, 1]}, "with at least one of each"),
    ],
)
def test_what_no_drone_can_have_is_refused(scenario, message):
    with pytest.raises(CommandError, match=message):
        Simulator(GameConfig(drones_per_team=2)).reset([0], scenario=scenario)


def test_without_captures_all_drones_may_be_of_one_team():
    simulator = Simulator(GameConfig(drones_per_team=2, capture=CaptureConfig(enabled=False)))
    simulator.reset([0], scenario={"teams": [1, 1, 1, 1]})
    assert simulator.sizes.tolist() == [[0, 4]]
