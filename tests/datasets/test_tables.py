"""Recorded games as a Minari dataset: what its player saw and did."""

from types import SimpleNamespace

import minari
import numpy as np
import pytest
from minari.dataset.minari_storage import MinariStorage

from swarm_pz.config import CaptureConfig, ObservationConfig
from swarm_pz.datasets import record_table
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import RecordingError
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from tests.play.recordings.games import CONFIG, record

SMALL = ObservationConfig(grid=10)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Give the bytes of a recorded game that was played to its end."""
    path = tmp_path_factory.mktemp("games") / "a.jsonl"
    record(path, ticks=1000)
    return path.read_bytes()


def test_an_episode_is_the_recorded_game_second_by_second(recorded, tmp_path):
    (tmp_path / "a.jsonl").write_bytes(recorded)
    recording = Recording.read(tmp_path / "a.jsonl")
    folder = record_table([tmp_path], root=tmp_path / "out", observation=SMALL, action="command")
    (episode,) = minari.MinariDataset(folder / "data")
    playback = Playback(recording)
    batch = BatchEnv(CONFIG.game)
    batch.simulator = playback.game.simulator
    sizes = []
    for step, seen in enumerate(episode.observations):
        playback.seek(30 * step)
        batch.simulator = playback.game.simulator
        assert (seen == batch.observe(SMALL, 0)[0]).all()
        sizes.append(playback.game.sizes[0])
    end = recording.end
    assert len(episode.rewards) == -(-end.tick // 30)
    assert episode.infos["size"].tolist() == sizes
    assert episode.infos["time_s"][-1] == end.tick / 30
    assert episode.terminations[-1] == (end.outcome != "draw") and not episode.terminations[:-1].any()
    assert episode.truncations[-1] == (end.outcome == "draw") and not episode.truncations[:-1].any()
    gains = (np.diff(sizes) / 4).tolist()
    gains[-1] += {"red": 1.0, "blue": -1.0, "draw": 0.0}[end.outcome]
    assert episode.rewards.tolist() == pytest.approx(gains)
    forced = recording.in_force()
    for step, action in enumerate(episode.actions):
        followed = [command for tick, command in forced if tick < 30 * (step + 1)]
        assert (action == followed[-1].values.astype(np.float32)).all()
    told = MinariStorage.read_raw_metadata(folder / "data")
    assert told["recordings"] == ["a.jsonl"] and told["opponents"] == ["ring"]
    assert told["rules_hash"] == CONFIG.game.rules_hash


OTHER = CONFIG.replace(game=CONFIG.game.replace(capture=CaptureConfig(threshold=0.9)))


@pytest.mark.parametrize(
    ("spoil", "player", "message"),
    [
        (lambda folder: (folder / "b.jsonl").write_text("{}\n"), "person", "line 1 of .*b.jsonl"),
        (lambda folder: None, "program", "no recorded game that counts has a seat of 'program'"),
        (lambda folder: record(folder / "b.jsonl", ticks=1000, config=OTHER), "person", "the same rules"),
        (lambda folder: (folder / "a.jsonl").unlink(), "person", "found none in"),
        (
            lambda folder: record(
                folder / "b.jsonl", ticks=1000, outcome="red" if winner(folder) == "blue" else "blue"
            ),
            "person",
            "b.jsonl is corrupt",
        ),
    ],
)
def test_recordings_that_make_no_dataset_are_refused_and_leave_nothing(spoil, player, message, recorded, tmp_path):
    games = tmp_path / "games"
    games.mkdir()
    (games / "a.jsonl").write_bytes(recorded)
    spoil(games)
    with pytest.raises(RecordingError, match=message):
        record_table([games], player=player, root=tmp_path / "out", observation=SMALL)
    assert not list((tmp_path / "out").glob("**/*"))


def winner(folder):
    return Recording.read(folder / "a.jsonl").end.outcome


def test_a_recording_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="there is no recording"):
        record_table([tmp_path / "none.jsonl"], root=tmp_path / "out")


def test_both_seats_of_the_games_that_count_see_them_from_their_own_side(recorded, tmp_path):
    (tmp_path / "a.jsonl").write_bytes(recorded)
    record(tmp_path / "b.jsonl", ticks=60)  # nobody played it to its end
    said, seats = [], ("person", "ring")
    datasets = [
        minari.MinariDataset(
            record_table([tmp_path], player=seat, root=tmp_path / "out", left_out=said.append) / "data"
        )
        for seat in seats
    ]
    assert said == ["b.jsonl: stopped"] * 2
    (red,), (blue,) = datasets
    assert red.rewards.any() and (red.rewards == -blue.rewards).all()
    assert (red.infos["size"] + blue.infos["size"] == 8).all()
    assert (red.infos["share"] == red.infos["size"] / 8).all()
    assert (red.infos["outcome"] == -blue.infos["outcome"]).all()
    assert (red.infos["captured"] == blue.infos["lost"]).all() and red.infos["captured"].any()
    assert (np.diff(red.infos["size"]) == (red.infos["captured"] - red.infos["lost"])[1:]).all()
    assert (blue.actions == blue.actions.max()).all() and np.ptp(red.actions) > 0, "who sends nothing covers uniformly"
    assert not red.infos["side"].any() and blue.infos["side"].all()
    about = [next(iter(one.storage.get_episode_metadata([0]))) for one in datasets]
    ends = {"red": ("win", "loss"), "blue": ("loss", "win"), "draw": ("draw", "draw")}
    assert tuple(one["outcome"] for one in about) == ends[winner(tmp_path)]
    assert [(one["side"], one["opponent"], one["seed"]) for one in about] == [("red", "ring", 1), ("blue", "P1", 1)]


def test_a_recording_that_plays_differently_here_is_refused(recorded, tmp_path, monkeypatch):
    (tmp_path / "a.jsonl").write_bytes(recorded)
    found = SimpleNamespace(faults=(), verified=False, first_difference=7)
    monkeypatch.setattr(Playback, "verify", lambda playback: found)
    with pytest.raises(RecordingError, match=r"a.jsonl plays differently here from tick 7"):
        record_table([tmp_path], root=tmp_path / "out")
