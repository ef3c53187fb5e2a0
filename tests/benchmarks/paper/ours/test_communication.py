from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper import coverage, talk
from benchmarks.paper.ours import communication
from swarm_pz.config import GameConfig
from tests import reference
from tests.benchmarks.paper.given import SEED, flights

SMALL = {"SEEDS": 3, "RADII": (1.5, 0.4, 0.0), "LOSSES": (0.0, 1.0)}
"""What makes the figure quick."""


RADII, LOSSES = communication.RADII, communication.LOSSES
RISING = dict(zip(RADII, np.linspace(1.0, 2.0, len(RADII)), strict=True))
LOSING = dict(zip(LOSSES, np.linspace(1.0, 2.0, len(LOSSES)), strict=True))
NOISE = np.linspace(-0.02, 0.02, communication.SEEDS)


@pytest.mark.parametrize(
    ("changed", "lone", "holds"),
    [
        ({}, 2.0, True),
        ({"radius": {0.2: 1.0}}, 2.0, False),  # hears less and surely does better
        ({"loss": {0.9: 1.0}}, 2.0, False),
        ({}, 2.6, False),  # lone drones are worse than a team that hears nobody
        ({}, 1.6, False),
        ({}, 2.4, True),
    ],
)
@pytest.mark.parametrize("target", communication.TARGETS)
def test_talk_counts_where_no_step_to_less_of_it_helps_and_silence_is_loneliness(
    monkeypatch, target, changed, lone, holds
):
    everywhere = communication.TARGETS

    def values(config, command, seeds, seconds):
        assert (seeds, seconds) == (communication.SEEDS, communication.JUDGED)
        here = command is everywhere[target]
        radius, loss = config.controller.communication_radius, config.controller.message_loss
        by_radius = RISING | (changed.get("radius", {}) if here else {})
        by_loss = LOSING | (changed.get("loss", {}) if here else {})
        value = by_radius[radius] if radius in by_radius and loss == 0.0 and radius != WHOLE else by_loss[loss]
        return np.tile((value + NOISE)[:, None], (1, 3)) * [5.0, 7.0, 1.0]

    flights(monkeypatch, talk, values)
    monkeypatch.setattr(
        communication,
        "alone",
        lambda seeds, name: np.full(len(seeds), lone if name == target else 2.0) + NOISE[: len(seeds)],
    )
    finding = communication.measure(SEED)
    assert finding.supported == holds
    assert finding.seeds == [3000 + number for number in range(20)]
    drawn = {name: finding.series[name][target]["mean"] for name in ("radius", "loss")}
    assert drawn["radius"] == pytest.approx([*(RISING | changed.get("radius", {})).values(), lone], rel=0.01)
    assert drawn["loss"] == pytest.approx([*(LOSING | changed.get("loss", {})).values()], rel=0.01)
    assert finding.statistic[f"lone_drones_over_all_to_all_{target}"] == pytest.approx(lone, rel=0.01)
    assert finding.statistic[f"radius_0_over_lone_drones_{target}"] == pytest.approx(2.0 / lone, rel=0.01)
    assert finding.statistic[f"steps_of_loss_that_fall_{target}"] == int("loss" in changed)
    assert finding.statistic[f"steps_of_radius_that_fall_{target}"] == int("radius" in changed)


WHOLE = GameConfig().controller.communication_radius


def test_lone_drones_know_of_nobody_and_are_judged_together(monkeypatch):
    monkeypatch.setattr(communication, "DRONES", 3)
    monkeypatch.setattr(communication, "JUDGED", 1)
    found = communication.alone([4, 7], "centre")
    together = coverage.start(coverage.lone_team(3), [4, 7], coverage.TARGETS["centre"])
    for game in range(2):
        places = []
        for drone in range(3):
            one = coverage.start(coverage.lone_team(1), [0], coverage.TARGETS["centre"])
            one.games.positions[0, 0] = together.positions[game, drone]
            for _ in range(10):
                one.advance(3)
                places.append(reference.basis(one.positions[0, 0]))
        phi = together.games.coefficients[game, 0]
        assert found[game] == pytest.approx(reference.ergodic_metric(np.mean(places, axis=0), phi), rel=1e-6)
