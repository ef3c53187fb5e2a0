"""What must not matter to systems that take images: how the square lies, drones' numbers, other games."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.systems.coverage import Coverage
from swarm_pz.systems.potential_field import PotentialField
from tests.systems import reference_coverage, reference_potential_field
from tests.systems.drawn_flights import permuted, together, turn
from tests.systems.image_flights import CONFIG, SYMMETRIES, random_image_flight, turned_image_flight

SYSTEMS = {"coverage": Coverage(), "potential_field": PotentialField()}


@pytest.fixture(params=SYSTEMS)
def system(request):
    return SYSTEMS[request.param]


@pytest.mark.parametrize("reference", [reference_coverage, reference_potential_field])
def test_it_is_its_slow_mirror(reference):
    assert reference.compare(60, seed=0) < 1e-4


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_a_turned_square_turns_the_accelerations(symmetry, system):
    generator = np.random.default_rng(1)
    for size in (1, 2, 7, 20):
        flight = random_image_flight(generator, system, size)
        own = flight.own[0]
        one = system.solve(flight, CONFIG)[0][own]
        other = system.solve(turned_image_flight(flight, symmetry), CONFIG)[0][own]
        np.testing.assert_allclose(turn(one, symmetry, 0.0), other, atol=1e-9)


def test_drones_may_have_any_numbers(system):
    generator = np.random.default_rng(2)
    for size in (2, 10, 30):
        flight = random_image_flight(generator, system, size)
        order = generator.permutation(flight.own.shape[1])
        one, other = system.solve(flight, CONFIG)[0], system.solve(permuted(flight, order), CONFIG)[0]
        np.testing.assert_allclose(one[order], other, atol=1e-9)


def test_a_game_is_the_same_alone_and_among_others(system):
    generator = np.random.default_rng(3)
    flights = []
    while len(flights) < 6:
        flight = random_image_flight(generator, system, 8)
        if flight.own.shape[1] == 10:
            flights.append(flight)
    many = system.solve(together(flights), CONFIG)
    for row, flight in enumerate(flights):
        np.testing.assert_array_equal(many[row], system.solve(flight, CONFIG)[0])
