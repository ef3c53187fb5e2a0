from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import GameConfig, SpawnConfig
from swarm_pz.errors import CommandError
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.spawn import check_seed, next_seed
from tests.games import assert_same

AT_REST = np.zeros((2, 2))


@pytest.mark.parametrize(
    ("sizes", "spawn", "places", "velocities", "luck"),
    [
        (1, {}, [[0.969768, 0.918369], [0.976019, 0.107923]], AT_REST, 13456836363123071557),
        ((1, 2), {"inset": 0.3, "radius": 0.2, "speed": 0.2},
         [[0.854934, 0.716147], [0.766133, 0.1425], [0.425855, 0.223153]],
         [[0.000548, 0.171481], [-0.006717, -0.145931], [-0.035131, -0.172636]], 15049841714506250060),
        (1, {"layout": "squares"}, [[0.163696, 0.126979], [0.895903, 0.898347]], AT_REST, 16837368535893154894),
        ((1, 2), {"layout": "squares", "inset": 0.2, "side": 0.4, "speed": 0.4},
         [[0.454785, 0.307915], [0.783611, 0.793389], [0.474692, 0.434898]],
         [[0.374029, 0.326341], [-0.001095, -0.342962], [-0.013434, -0.291862]], 10028111089635196863),
    ],
    ids=["corners", "other corners", "squares", "other squares"],
)  # fmt: skip
def test_a_seed_always_gives_the_same_start_and_the_same_luck(sizes, spawn, places, velocities, luck):
    simulator = Simulator(GameConfig(drones_per_team=sizes, spawn=SpawnConfig(**spawn)), num_games=2)
    simulator.reset([1, 0])
    np.testing.assert_allclose(simulator.positions[1], places, atol=1e-6)
    np.testing.assert_allclose(simulator.velocities[1], velocities, atol=1e-6)
    assert simulator.games.seeds[1] == luck != simulator.games.seeds[0]
    still = Simulator(simulator.config.replace(spawn=SpawnConfig(**(spawn | {"speed": 0.0}))), num_games=2)
    still.reset([1, 0])
    for name in ("positions", "altitudes", "seeds"):  # which do not depend on the speed
        np.testing.assert_array_equal(getattr(still.games, name), getattr(simulator.games, name))


def test_drones_start_near_any_corner_and_evenly_within_the_radius():
    simulator = Simulator(num_games=100)
    simulator.reset(range(100))
    places = simulator.positions.reshape(-1, 2).astype(float)
    corners = np.where(places > 0.5, 0.9, 0.1)
    distance = np.linalg.norm(places - corners, axis=1)
    assert distance.max() <= 0.08 + 1e-6 and (distance < 0.04).mean() == pytest.approx(0.25, abs=0.04)
    for corner in np.unique(corners, axis=0):
        assert (corners == corner).all(axis=1).mean() == pytest.approx(0.25, abs=0.04)


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
        assert_same(simulator.games, drawn._replace(**{name: np.broadcast_to(values, getattr(drawn, name).shape)}))


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
