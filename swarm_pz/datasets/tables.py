"""Recorded games of people and programs at the table as a dataset.

A table has no steps: commands come whenever they come. A step of an episode is a command period of the game; what was
done in it is the command that the team followed when it ended.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import RED, TEAM_NAMES, GameConfig, ObservationConfig
from swarm_pz.datasets.folder import Episode, Target, name_for, new_dataset
from swarm_pz.datasets.matches import OUTCOMES
from swarm_pz.envs.batch_env import BatchEnv, StepResult, by_game
from swarm_pz.envs.reward import red_rewards
from swarm_pz.errors import RecordingError
from swarm_pz.play.commands import Command
from swarm_pz.play.recordings.folder import SUFFIX, is_regular
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.recordings.seats import SeatRow, seat_rows
from swarm_pz.spaces.formats import Format, FormatOptions
from swarm_pz.spaces.observation import of_game

PERSON = "person"


def record_table(
    recordings: Sequence[Path],
    *,
    player: str = PERSON,
    name: str | None = None,
    root: Path | None = None,
    observation: ObservationConfig | None = None,
    command: str = "",
    progress: Callable[[float, float], None] | None = None,
    left_out: Callable[[str], None] | None = None,
    **options: Unpack[FormatOptions],
) -> Path:
    """Write recorded games as a Minari dataset of what their players saw and did; return its folder.

    Parameters
    ----------
    recordings : sequence of Path
        Files that the table wrote, or folders of these.
    player : str
        Whose views: "person", "program", "policy", or the name of a policy or a label.
    name : str, optional
        The dataset's id; ``swarm-PLAYER-v0`` if not given.
    root : Path, optional
        Folder of datasets; Minari's own if not given.
    observation : ObservationConfig, optional
        What observations show: the drones as they were, not the page; all channels if not given.
    command : str
        What was called; it stands in the metadata.
    progress : callable, optional
        Called with (recordings read, recordings in all).
    left_out : callable, optional
        Called with a line about each game that does not count: unfinished, a lesson, left, and so on.
    **options
        How observations and actions are written: those of `swarm_pz.spaces.formats.Format`.

    Returns
    -------
    Path

    Raises
    ------
    RecordingError
        If a file is no whole recorded game, or plays differently here, or rules differ, or no game is left; nothing is
        written.
    ConfigError, OutputError
        If the name, an option or the folder is not one that can be had.
    """
    target = Target(name=name if name is not None else name_for(player), root=root)
    observation = observation if observation is not None else ObservationConfig()
    say = left_out if left_out is not None else lambda _: None
    found = _chosen(_files(recordings), player, say)
    config = found[0].config.replace(observation=observation)
    systems = [config.team_systems[TEAM_NAMES.index(view.row.side)] for view in found]
    forms = [Format(config, observation, system, **options) for system in systems]
    other = next((at for at, form in enumerate(forms) if form.action_space != forms[0].action_space), None)
    if other is not None:
        raise RecordingError(
            f"the views of one dataset must be of the same control system, got {found[0].row.system} in "
            f"{found[0].row.recording} and {found[other].row.system} in {found[other].row.recording}: record them apart"
        )
    opponents = list(dict.fromkeys(view.opponent for view in found))
    told = {
        "algorithm_name": player,
        "description": f"games of a table as seen by {player}: observations, actions, rewards",
        "source": "recordings",
        "player": player,
        "opponents": opponents,
        "recordings": [view.row.recording for view in found],
        "software": sorted({view.software for view in found}),
        "seeds": [view.seed for view in found],
    }
    with new_dataset(target, forms[0], config, {}, options, told, command) as writer:
        for done, (view, form) in enumerate(zip(found, forms, strict=True), 1):
            number = opponents.index(view.opponent)
            writer.add([_episode(view.path, view.row, form, number)])
            if progress is not None:
                progress(done, len(found))
    return target.folder


def _files(given: Sequence[Path]) -> list[Path]:
    files: list[Path] = []
    for path in given:
        if path.is_dir():
            files += sorted(one for one in path.glob(f"*{SUFFIX}") if is_regular(one))
        elif path.exists():
            files.append(path)
        else:
            raise RecordingError(f"there is no recording, nor a folder of recordings, {str(path)!r}")
    if not files:
        raise RecordingError(f"expected recordings, files that end in {SUFFIX}; found none in {_named(given)}")
    return files


def _named(paths: Sequence[Path]) -> str:
    return ", ".join(map(str, paths)) or "nothing: name a file or a folder"


class _View(NamedTuple):
    """A seat whose views are asked for, of a game that was played again."""

    path: Path
    software: str
    seed: int
    config: GameConfig
    row: SeatRow

    @property
    def opponent(self) -> str:
        return self.row.opponent or self.row.opponent_kind


def _chosen(files: Sequence[Path], player: str, say: Callable[[str], None]) -> list[_View]:
    """Return the seats whose views are asked for, all of one game's rules."""
    found: list[_View] = []
    for path in files:
        views = _views(path, player)
        row = views[0].row if views else None
        if row is not None and row.left_out:
            say(f"{row.recording}: {row.left_out}")
            continue
        if row is not None and found and row.rules_hash != found[0].row.rules_hash:
            raise RecordingError(
                f"the games of one dataset must have the same rules, got rules {found[0].row.rules_hash} in "
                f"{found[0].row.recording} and {row.rules_hash} in {row.recording}: record them apart"
            )
        found += views
    if not found:
        raise RecordingError(f"no recorded game that counts has a seat of {player!r}: a person, a program or a name")
    return found


def _views(path: Path, player: str) -> list[_View]:
    """Return the seats of a game whose views are asked for; it is played again if it counts."""
    recording = Recording.read(path)
    rows = [row for row in seat_rows(recording) if player in (row.kind, row.player)]
    if rows and not rows[0].left_out:
        _check(recording)
    told, config = recording.header, recording.config.game
    return [_View(path, told.software, told.seed, config, row) for row in rows]


def _check(recording: Recording) -> None:
    verification = Playback(recording).verify()
    if verification.faults:
        raise RecordingError(f"{recording.name} is corrupt: {verification.faults[0]}")
    if not verification.verified:
        raise RecordingError(
            f"{recording.name} plays differently here from tick {verification.first_difference} on: it was changed, or "
            "recorded by another version or on another kind of processor; make the dataset there"
        )


def _episode(path: Path, row: SeatRow, form: Format, opponent: int) -> Episode:
    """Play a recorded game again, step by step, as one seat saw it."""
    recording = Recording.read(path)
    playback, team = Playback(recording), TEAM_NAMES.index(row.side)
    game, config = playback.game, recording.config.game
    batch = BatchEnv(config)
    batch.simulator = game.simulator
    end = recording.last_tick
    followed = _first(playback, team)
    observations = [of_game(batch.observe(form.observation, team), 0)]
    mine, only = np.array([team]), np.zeros(1, np.int64)
    infos = by_game(batch.infos(None, mine, only))
    actions, rewards, decided = [], [], []
    while game.tick < end:
        games = game.simulator.games
        before, captures, recaptures = game.simulator.sizes[:, RED], games.captures.copy(), games.recaptures.copy()
        came = [one for one in playback.advance(config.step_ticks) if one.team == team]
        followed = _values(playback, came[-1]) if came else followed
        over = game.simulator.decided.copy()
        after = game.simulator.sizes[:, RED]
        red = red_rewards(config, after - before, over, after > 0)
        result = StepResult(
            rewards=np.stack([red, 0.0 - red], axis=1),
            terminated=over,
            truncated=~over & (game.tick >= end),
            captured=games.captures - captures,
            recaptured=games.recaptures - recaptures,
        )
        observations.append(of_game(batch.observe(form.observation, team), 0))
        infos += by_game(batch.infos(result, mine, only))
        actions.append(followed)
        rewards.append(result.rewards[0, team])
        decided.append(bool(over[0]))
    shown = [form.show(one) for one in observations]
    more = {"share": [info["size"] / config.num_drones for info in infos]}
    more |= {"side": [team] * len(infos), "opponent": [opponent] * len(infos)}
    truncated = np.zeros(len(rewards), np.bool_)
    truncated[-1] = not decided[-1]
    return Episode(
        observations=(
            {key: np.stack([one[key] for one in shown]) for key in shown[0]}
            if isinstance(shown[0], dict)
            else np.stack(shown)
        ),
        actions=form.write(np.stack(actions)),
        rewards=np.array(rewards),
        terminations=np.array(decided),
        truncations=truncated,
        infos={key: np.array([info[key] for info in infos]) for key in infos[0]}
        | {key: np.array(values) for key, values in more.items()},
        seed=recording.header.seed,
        about={
            "side": row.side,
            "opponent": row.opponent or row.opponent_kind,
            "outcome": OUTCOMES[int(infos[-1]["outcome"])],
            "recording": recording.name,
        },
    )


def _first(playback: Playback, team: int) -> NDArray[np.float64]:
    """Return what a team follows before its first command."""
    config = playback.recording.config.game
    system = config.team_systems[team]
    if system.takes == "density":
        return np.ones((config.command_cells, config.command_cells))
    return np.asarray(system.default(config), np.float64)


def _values(playback: Playback, command: Command) -> NDArray[np.float64]:
    """Return a command as what its team's control system takes."""
    game = playback.game
    control = game.simulator.control
    return np.asarray(control.unpack(game.reader.packed(command), control.numbers[command.team])[0])
