"""A recorded game as rows of an experiment."""

from dataclasses import asdict

from swarm_pz.play.recordings.format import CapturedLine, Recording
from swarm_pz.play.recordings.seats import seat_rows, trial_rows
from tests.play.recordings.test_study import PAST, header


def test_a_row_of_an_experiment_is_that_of_the_tables_with_captures_losses_and_the_seed():
    taken = [CapturedLine(tick=900, drone=0, team=1), CapturedLine(tick=901, drone=1, team=1)]
    back = [CapturedLine(tick=902, drone=0, team=0)]
    recording = Recording("a.jsonl", header(), PAST + taken + back)
    before = [line for line in PAST if isinstance(line, CapturedLine)]
    counts = [sum(line.team == team for line in before + taken + back) for team in range(2)]
    red, blue = trial_rows(recording)
    assert (red["captured"], red["lost"]) == tuple(counts)
    assert (blue["captured"], blue["lost"]) == tuple(reversed(counts))
    assert red["seed"] == blue["seed"] == recording.header.seed
    assert [
        {name: row[name] for name in asdict(one)} for one, row in zip(seat_rows(recording), (red, blue), strict=True)
    ] == [asdict(one) for one in seat_rows(recording)]
