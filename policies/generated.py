"""Generated opponents: each game's seed draws one opponent of a kind.

There are two disjoint sets of kinds: `TRAINING`, which `generated` plays and policies may train against, and `TEST`,
which is only for evaluation. The kinds of `TEST` have no registered names, so that no training run finds them.

A kind takes its parameters from a game's `View.traits`, which are uniform in [0, 1) and the same to the game's end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.policies.scripted import CLOCK, OPPONENTS, Tactic, View, tactic
from swarm_pz.spaces.densities import disc

Array = NDArray[np.float64]


def _scaled(trait: Array, low: float, high: float) -> Array:
    """Return numbers in [low, high) for traits, uniform on a logarithmic scale."""
    return np.asarray(low * (high / low) ** trait)


def _anywhere(view: View, first: int) -> Array:
    """Return a point (n, 2) for each game, with half of the coordinates at a wall: all corners and edges occur."""
    traits = view.traits[:, first : first + 2]
    return np.where(traits < 0.25, 0.04, np.where(traits >= 0.75, 0.96, 2.0 * traits - 0.5))


def _turns(view: View, trait: Array, shortest: float, longest: float) -> Array:
    """Return the periods (n,) passed since the start; a period takes from `shortest` to `longest` commands."""
    return np.asarray(view.steps / _scaled(trait, shortest, longest))


def _spot(view: View, places: Array, width: Array) -> Array:
    """Return a Gaussian (n, A, A) around places (n, 2) of widths (n,)."""
    return np.asarray(disc(view.distance_from(places) / width[:, None, None], 1.0))


def _around(centres: Array, radius: Array, turns: Array) -> Array:
    """Return the points (n, 2) that are reached on circles after some turns."""
    angles = 2.0 * np.pi * turns
    return np.asarray(centres + radius[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1))


@tactic(sees=CLOCK)
def hide(view: View) -> Array:
    """Send everyone to one place, of any width, and never change it."""
    return _spot(view, _anywhere(view, 0), _scaled(view.traits[:, 2], 0.03, 0.3))


@tactic(sees=CLOCK)
def circle(view: View) -> Array:
    """Send everyone around a circle, either way round, in 4 to 60 s."""
    traits = view.traits
    turns = np.where(traits[:, 0] < 0.5, -1.0, 1.0) * _turns(view, traits[:, 1], 4.0, 60.0) + traits[:, 2]
    places = _around(0.35 + 0.3 * traits[:, 3:5], 0.1 + 0.35 * traits[:, 5], turns)
    return _spot(view, places, _scaled(traits[:, 6], 0.05, 0.2))


@tactic(sees=CLOCK)
def lap(view: View) -> Array:
    """Run around the middle, close together, either way round, in 5 to 8 s: about as long as trails last."""
    traits = view.traits
    turns = np.where(traits[:, 0] < 0.5, -1.0, 1.0) * _turns(view, traits[:, 1], 5.0, 8.0) + traits[:, 2]
    places = _around(0.45 + 0.1 * traits[:, 3:5], 0.15 + 0.2 * traits[:, 5], turns)
    return _spot(view, places, _scaled(traits[:, 6], 0.03, 0.12))


@tactic(sees=CLOCK)
def pulse(view: View) -> Array:
    """Spread from one place and return to it, in 5 to 30 s."""
    traits = view.traits
    phase = 2.0 * np.pi * (_turns(view, traits[:, 2], 5.0, 30.0) + traits[:, 3])
    return _spot(view, _anywhere(view, 0), _scaled(0.5 + 0.5 * np.sin(phase), 0.05, 0.5))


@tactic(sees=CLOCK)
def tilt(view: View) -> Array:
    """Be denser towards one side, which turns in 20 to 200 s."""
    traits = view.traits
    angles = 2.0 * np.pi * (_turns(view, traits[:, 0], 20.0, 200.0) + traits[:, 1])
    across = (view.x - 0.5) * np.cos(angles)[:, None, None] + (view.y - 0.5) * np.sin(angles)[:, None, None]
    return np.asarray(np.exp(_scaled(traits[:, 2], 1.0, 12.0)[:, None, None] * (across - 0.75)))


TRAINING = (hide, lap, circle, pulse, tilt)
"""The kinds that policies may train against."""


@tactic(sees=CLOCK)
def generated(view: View) -> Array:
    """Play a random opponent in each game: a third of the games `hide`, a third `lap`, the rest other kinds."""
    kinds = np.array([0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 3, 4])[np.floor(12.0 * view.traits[:, -1]).astype(int)]
    images = [kind.play(view) for kind in TRAINING]
    return np.select([kinds[:, None, None] == number for number in range(len(TRAINING))], images)


@tactic(sees=CLOCK)
def strip(view: View) -> Array:
    """Stay along a line across the square, at any angle, and never change it."""
    traits = view.traits
    angles = np.pi * traits[:, 0]
    along = (view.x - 0.5) * np.cos(angles)[:, None, None] + (view.y - 0.5) * np.sin(angles)[:, None, None]
    offset = 0.96 * (traits[:, 1] - 0.5)
    return np.asarray(disc((along - offset[:, None, None]) / _scaled(traits[:, 2], 0.03, 0.15)[:, None, None], 1.0))


@tactic(sees=CLOCK)
def nooks(view: View) -> Array:
    """Stay in two corners, unequally, and never change it."""
    traits = view.traits
    first = (4.0 * traits[:, 0]).astype(int)
    second = (first + 1 + (3.0 * traits[:, 1]).astype(int)) % 4
    corners, width = (
        np.array([[0.04, 0.04], [0.96, 0.04], [0.96, 0.96], [0.04, 0.96]]),
        _scaled(traits[:, 2], 0.03, 0.2),
    )
    return _spot(view, corners[first], width) + (0.4 + 0.6 * traits[:, 3, None, None]) * _spot(
        view, corners[second], width
    )


@tactic(sees=CLOCK)
def spoke(view: View) -> Array:
    """Turn a bar around a place in the middle, either way round, in 8 to 60 s."""
    traits = view.traits
    angles = (
        2.0 * np.pi * (np.where(traits[:, 0] < 0.5, -1.0, 1.0) * _turns(view, traits[:, 1], 8.0, 60.0) + traits[:, 2])
    )
    x, y = view.x - 0.4 - 0.2 * traits[:, 3, None, None], view.y - 0.4 - 0.2 * traits[:, 4, None, None]
    away = y * np.cos(angles)[:, None, None] - x * np.sin(angles)[:, None, None]
    return np.asarray(disc(away / _scaled(traits[:, 5], 0.04, 0.12)[:, None, None], 1.0))


@tactic(sees=CLOCK)
def twins(view: View) -> Array:
    """Run two spots around a circle, opposite each other, either way round, in 6 to 40 s."""
    traits = view.traits
    turns = np.where(traits[:, 0] < 0.5, -1.0, 1.0) * _turns(view, traits[:, 1], 6.0, 40.0) + traits[:, 2]
    centres, radius = 0.4 + 0.2 * traits[:, 3:5], 0.2 + 0.2 * traits[:, 5]
    width = _scaled(traits[:, 6], 0.04, 0.12)
    return _spot(view, _around(centres, radius, turns), width) + _spot(
        view, _around(centres, radius, turns + 0.5), width
    )


@tactic(sees=CLOCK)
def fence(view: View) -> Array:
    """Stay along the walls but for a gap, which runs round in 15 to 90 s."""
    traits = view.traits
    to_wall = np.minimum(np.minimum(view.x, 1.0 - view.x), np.minimum(view.y, 1.0 - view.y))
    band = disc(to_wall / _scaled(traits[:, 0], 0.05, 0.15)[:, None, None], 1.0)
    gap = _around(np.full((len(traits), 2), 0.5), np.full(len(traits), 0.5), _turns(view, traits[:, 1], 15.0, 90.0))
    return np.asarray(band * (1.0 - _spot(view, gap, 0.15 + 0.2 * traits[:, 2])))


@tactic(sees=OPPONENTS, grid=25)
def moat(view: View) -> Array:
    """Surround the mirror image of the opponents' mean position, across either axis or the middle, by a ring."""
    traits = view.traits
    flips = np.stack([traits[:, 0] < 2 / 3, traits[:, 0] >= 1 / 3], axis=1)
    place = view.mean_position("opposing")
    distance = view.distance_from(np.where(flips, 1.0 - place, place))
    radius = (0.2 + 0.15 * traits[:, 1])[:, None, None]
    return np.asarray(disc((distance - radius) / _scaled(traits[:, 2], 0.04, 0.1)[:, None, None], 1.0))


@tactic(sees=CLOCK)
def waves(view: View) -> Array:
    """Hold a random image of Fourier modes for 4 to 20 s, and then another."""
    traits = view.traits
    number = np.floor(_turns(view, traits[:, 0], 4.0, 20.0))
    image = np.zeros((len(number), *view.x.shape))
    for mode, (across, up) in enumerate(((0, 2), (2, 0), (2, 1), (1, 2), (2, 2), (0, 3), (3, 0), (3, 3))):
        # Another weight in [-1, 1) for each image: multiples of an irrational number fill the unit interval evenly.
        weight = 2.0 * ((traits[:, 1 + mode] + number * (0.6180339887 + 0.1 * mode)) % 1.0) - 1.0
        image += weight[:, None, None] * np.cos(np.pi * across * view.x) * np.cos(np.pi * up * view.y)
    return np.asarray(np.exp(1.5 * image))


TEST: tuple[Tactic, ...] = (strip, nooks, spoke, twins, fence, moat, waves)
"""The kinds for evaluation only."""
