"""The curves of a game are those of the game that a match counted, and each panel shows its own."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from swarm_pz.analysis.diagnosis import WINDOW_S, diagnose, plot
from swarm_pz.config import GameConfig
from swarm_pz.errors import RenderError
from swarm_pz.evaluation.match import play_match
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.rendering.board import TEAM_COLOURS
from tests import reference


@pytest.fixture(scope="module")
def diagnosis():
    return diagnose("ring", "uniform", seed=1, seconds=8)


def test_moments_are_the_start_and_every_control_period_and_captures_account_for_sizes(diagnosis):
    np.testing.assert_allclose(diagnosis.times, np.arange(81) / 10)
    for name in ("sizes", "captures", "recaptures", "metric", "latest_metric", "entropy_bits"):
        assert getattr(diagnosis, name).shape == (81, 2), name
    assert diagnosis.captures.any() and not diagnosis.captures[0].any()
    gained = diagnosis.captures - diagnosis.captures[:, ::-1]
    np.testing.assert_array_equal(np.diff(diagnosis.sizes, axis=0), gained[1:])
    assert (diagnosis.recaptures <= diagnosis.captures).all()


def test_a_uniform_command_is_spread_over_the_whole_square_and_a_ring_is_not(diagnosis):
    np.testing.assert_allclose(diagnosis.entropy_bits[:, 1], math.log2(100))
    np.testing.assert_allclose(diagnosis.effective_share[:, 1], 1.0)
    assert (diagnosis.effective_share[1:, 0] < 0.6).all()
    game = Rollout("ring", "uniform", [0], seed=1)
    game.play(1)
    bits = -sum(share * math.log2(share) for share in game.simulator.targets[0, 0].ravel() if share > 0)
    assert diagnosis.entropy_bits[5, 0] == pytest.approx(bits)


def test_the_metrics_are_those_of_the_true_past_and_of_its_end(diagnosis):
    game, window = Rollout("ring", "uniform", [0], seed=1), round(10 * WINDOW_S)
    places: list[list[np.ndarray]] = []

    def look(game):
        of_blue = game.simulator.positions[0][game.simulator.teams[0] == 1]
        places.append([reference.basis(place) for place in of_blue])

    game.play(8, after_control_period=look)
    phi = game.simulator.games.coefficients[0, 1]
    for past, metric in ((places, diagnosis.metric), (places[-window:], diagnosis.latest_metric)):
        mean = np.mean([value for moment in past for value in moment], axis=0)
        assert metric[-1, 1] == pytest.approx(reference.ergodic_metric(mean, phi), rel=1e-6)
    assert np.isnan(diagnosis.metric[0]).all()
    np.testing.assert_allclose(diagnosis.metric[1:window], diagnosis.latest_metric[1:window])


def test_json_holds_every_curve_and_no_nan(diagnosis):
    plain = json.loads(json.dumps(diagnosis.to_dict(), allow_nan=False))
    named = {
        "ergodic_metric": "metric",
        "latest_ergodic_metric": "latest_metric",
        "command_entropy_bits": "entropy_bits",
    }
    named |= {"command_effective_share": "effective_share"} | {n: n for n in ("sizes", "captures", "recaptures")}
    assert {name for name, value in plain.items() if isinstance(value, dict)} == set(named)
    for name, attribute in named.items():
        values = np.array([plain[name][team] for team in ("red", "blue")], float).T
        np.testing.assert_allclose(values, getattr(diagnosis, attribute), atol=1e-8, err_msg=name)
    assert plain["ergodic_metric"]["red"][0] is None and len(plain["times_s"]) == 81
    assert plain["window_s"] == WINDOW_S and plain["config_hash"] == GameConfig().hash


@pytest.mark.parametrize(
    ("result", "title"),
    [
        ("red won", "ring (red) beat uniform (blue) in 8.0 s"),
        ("blue won", "uniform (blue) beat ring (red) in 8.0 s"),
        ("a draw", "ring (red) and uniform (blue) drew after 8.0 s, {} drones to {}"),
        ("unfinished", "ring (red) and uniform (blue) had not finished after 8.0 s, {} drones to {}"),
    ],
)
def test_the_title_states_the_result(diagnosis, result, title):
    assert dataclasses.replace(diagnosis, result=result).title == title.format(*diagnosis.sizes[-1])


def test_the_curves_are_of_the_game_that_a_match_counted_to_its_deciding_tick(tmp_path):
    config = GameConfig(time_limit=20.0, drones_per_team=(1, 5))
    counted = play_match("corners", "noise", games=6, seed=3, config=config).games[5]
    shown = diagnose("corners", "noise", seed=3, pair=2, side="blue", config=config)
    assert (counted.pair, counted.side) == (2, "blue") and counted.outcome != "draw"
    assert shown.names == ("noise", "corners") and shown.times[-1] == counted.seconds
    assert shown.sizes[[*range(0, len(shown.sizes) - 1, 10), -1], 0].tolist() == counted.sizes
    assert shown.captures.sum() == counted.captures and shown.recaptures.sum() == counted.recaptures
    assert shown.result == {"win": "blue won", "loss": "red won"}[counted.outcome] and 0 in shown.sizes[-1]
    assert np.isfinite(shown.latest_metric[1:]).all()
    plain = shown.to_dict()
    assert (plain["red"], plain["seed"], plain["pair"], plain["side"]) == ("noise", 3, 2, "blue")
    plot(shown, tmp_path / "pictures" / "game.png")
    assert (tmp_path / "pictures" / "game.png").read_bytes().startswith(b"\x89PNG")


def test_how_far_a_game_is_can_be_shown_and_one_of_no_length_is_refused():
    told = []
    diagnose("ring", "uniform", seconds=2.5, progress=told.append)
    assert told == [1.0, 2.0, 3.0]
    for seconds in (0.0, -1.0, math.nan, math.inf, True):
        with pytest.raises(RenderError, match="above 0"):
            diagnose("ring", "uniform", seconds=seconds)


def test_every_panel_shows_its_curves_in_their_teams_colours(diagnosis, tmp_path, monkeypatch):
    drawn, save = [], Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda figure, *given, **how: drawn.append(figure) or save(figure, *given))
    again = diagnosis.captures * [1, 0] * (diagnosis.times[:, None] > 4.0)
    assert again.any()
    plot(dataclasses.replace(diagnosis, recaptures=again), tmp_path / "game.png")
    sizes, captures, metric, command = drawn[0].axes
    for team, name in enumerate(("red: ring", "blue: uniform")):
        colour = np.array(TEAM_COLOURS[team]) / 255
        size, latest, share = (axes.lines[team] for axes in (sizes, metric, command))
        assert size.get_label() == name
        for line in (size, latest, share):
            np.testing.assert_allclose(to_rgb(line.get_color()), colour)
        np.testing.assert_array_equal(size.get_ydata(), diagnosis.sizes[:, team])
        np.testing.assert_array_equal(latest.get_ydata(), diagnosis.latest_metric[:, team])
        np.testing.assert_array_equal(share.get_xydata().T, [diagnosis.times[1:], diagnosis.effective_share[1:, team]])
        taken = captures.collections[team]
        up, some = (1, -1)[team], diagnosis.captures[:, team] > 0
        np.testing.assert_allclose(taken.get_colors()[0][:3], colour)
        ends = np.array(taken.get_segments()).reshape(-1, 2, 2)
        np.testing.assert_allclose(ends[:, 0], np.stack([diagnosis.times[some], 0 * diagnosis.times[some]], axis=1))
        np.testing.assert_allclose(ends[:, 1, 1], up * diagnosis.captures[some, team])
    rings = [line.get_xdata().tolist() for line in captures.lines[:2]]
    assert rings == [diagnosis.times[again[:, 0] > 0].tolist(), []]
