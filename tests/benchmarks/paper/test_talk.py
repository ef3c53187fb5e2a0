from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure as Canvas

from benchmarks.paper import coverage, talk


def test_steps_that_surely_fall_are_counted():
    means = np.array([[1.0, 2.0, 2.0, 1.5, 3.0], [1.0, 2.0, 3.0, 4.0, 5.0]])
    noise = np.random.default_rng(0).normal(0.0, 0.01, (20, 2, 5))
    assert talk.steps_that_fall(means + noise).tolist() == [1, 0]


def test_the_worst_of_what_is_heard_is_told_in_times_of_hearing_nobody():
    quiet, loud = [[1.0, 3.0, 2.0], [5.0, 4.0, 4.0]], [[0.0, 0.0, 1.0], [0.5, 0.25, 1.0]]
    values = np.array([[quiet, loud], [quiet, loud]])  # (seeds, memories, targets, radii)
    values[1] *= 3.0
    assert talk.times_silence(values).tolist() == [1.5, 0.5]
    assert talk.times_silence(values[:, 0]) == 1.5


def test_a_ratio_is_of_means_over_the_same_seeds():
    below = np.linspace(1.0, 2.0, 20)
    value, (low, high) = talk.ratio(3 * below, below)
    assert (value, low, high) == pytest.approx((3.0, 3.0, 3.0))


def test_rules_of_a_team_alone_differ_in_what_is_named():
    plain = coverage.lone_team(talk.DRONES)
    assert talk.rules() == plain
    changed = talk.rules(2.0, communication_radius=0.1, relay=True)
    assert changed.memory == plain.memory.replace(controller=2.0)
    assert changed.controller == plain.controller.replace(communication_radius=0.1, relay=True)


def test_the_metric_is_of_each_seed_on_each_target_under_each_of_the_rules(monkeypatch):
    monkeypatch.setattr(talk, "JUDGED", 1)
    configs = {"all": talk.rules(), "nobody": talk.rules(communication_radius=0.0)}
    found = talk.covered(configs, [3, 8])
    assert found.shape == (2, 3, 2)
    for place, target in enumerate(coverage.TARGETS.values()):
        for number, config in enumerate(configs.values()):
            expected = coverage.metric_over_time(coverage.start(config, [3, 8], target), 1)[:, 0]
            np.testing.assert_array_equal(found[:, place, number], expected)


def test_curves_over_talk_are_means_with_their_intervals_side_by_side():
    axes = Canvas().subplots()
    found = {"one": {"mean": [2.0, 3.0], "low": [1.0, 2.5], "high": [4.0, 5.0]}}
    talk.over_talk(axes, talk.radius_names((1.5, 0.2)), found)
    (drawn,) = axes.containers
    assert drawn.lines[0].get_ydata().tolist() == [2.0, 3.0] and drawn.get_label() == "one"
    assert [segment.tolist() for segment in drawn.lines[2][0].get_segments()] == [[[0, 1], [0, 4]], [[1, 2.5], [1, 5]]]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["all", "0.2"]
