"""Commands of studies, as ``study run``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from swarm_pz.cli import printing
from swarm_pz.cli.options import HERE, AddressOptions
from swarm_pz.cli.play import need_play, serve
from swarm_pz.cli.player_options import known
from swarm_pz.cli.report import command, progress, say
from swarm_pz.config.base import check_count, check_number
from swarm_pz.errors import ConfigError, SwarmError, require_extra

if TYPE_CHECKING:
    from swarm_pz.play.studies.design import Study


def run(
    study: Annotated[Path, tyro.conf.Positional],
    /,
    folder: Path = Path("runs/study"),
    at: AddressOptions = HERE,
    allowed_hosts: tuple[str, ...] = (),
    countdown: float = 3.0,
) -> None:
    """Serve a study, or continue it: participants type a code and are led through it.

    Args:
        study: The study's file; see docs/studies.md.
        folder: Folder of the study's data, which is created or continued.
        allowed_hosts: Host names of proxies or tunnels that lead to this server, such as play.example.org.
        countdown: Seconds of countdown before each game, while its start is shown.
    """
    need_play()
    require_extra("markdown_it", "lab")
    from swarm_pz.play.studies.design import Study
    from swarm_pz.play.studies.folder import CODES, StudyFolder

    check_number(countdown, "countdown", 0.0, 60.0)
    _check_players(Study.read(study))
    opened = StudyFolder.begin(study, folder)
    plan = opened.study
    say(f"study: {plan.title}; the participants' codes are in {folder / CODES}")
    try:
        serve(
            known(),
            host=at.host,
            port=at.port,
            allowed_hosts=allowed_hosts,
            folder=folder / "games",
            countdown_s=countdown,
            record_labels=False,
            study=opened,
        )
    finally:
        opened.close()


def plan(study: Annotated[Path, tyro.conf.Positional], /, out: Path | None = None) -> None:
    """Show the plan of a study, to register it before the study begins; see docs/studies.md.

    Args:
        study: The study's file.
        out: Markdown file to write the plan to.
    """
    need_play()
    from swarm_pz.play.studies.design import Study
    from swarm_pz.play.studies.planning import plan_of

    text = plan_of(Study.read(study), study)
    if out is not None:
        out.write_text(text, encoding="utf-8")
    print(text if out is None else out)


def power(
    study: Annotated[Path, tyro.conf.Positional],
    /,
    difference: float = 0.2,
    share: float = 0.5,
    spread: float = 0.15,
    participants: tuple[int, ...] = (),
    runs: int = 200,
) -> None:
    """Simulate how often a study's tests find an effect on the share of games won; see docs/studies.md.

    Args:
        study: The study's file.
        difference: Effect on the share won; for an interaction, the difference of differences.
        share: Share of games that participants win.
        spread: Standard deviation of this share among participants.
        participants: Numbers of participants to try; by default, the study's number.
        runs: Simulated studies for each effect.
    """
    need_play()
    from swarm_pz.play.studies.design import Study
    from swarm_pz.play.studies.planning import power as simulate

    for name, value, high in (("difference", abs(difference), 1.0), ("share", share, 1.0), ("spread", spread, 1.0)):
        check_number(value, name, 0.0, high)
    check_count(runs, "runs", 1, 100_000)
    design, rows = Study.read(study), []
    for count in participants or (design.participants,):
        check_count(count, "participants", 1, 10_000)
        with progress("studies", "simulating") as show:
            rows += simulate(design, count, difference=difference, share=share, spread=spread, runs=runs, progress=show)
    printing.print_power(rows)


def _check_players(study: Study) -> None:
    """Check that the policies that participants meet can be loaded, before anybody waits for them."""
    from swarm_pz import policies
    from swarm_pz.config import TEAM_NAMES

    for condition in study.conditions:
        game, own = condition.game(study.rules), TEAM_NAMES.index(condition.side)
        named = [] if condition.is_of_two else [("opponent", condition.opponent, 1 - own)]
        named += [("practice.opponent", study.practice.opponent, 1 - own)] if study.practice.wins else []
        named += [("helper", condition.helper, own)] if condition.share else []
        for field, name, team in named:
            try:
                policies.load(name, game, game.team_systems[team])
            except SwarmError as error:
                raise ConfigError(f"condition {condition.title!r}: {field}: {error}") from error


def status(folder: Annotated[Path, tyro.conf.Positional], /) -> None:
    """Show the progress of each participant of a study.

    Args:
        folder: Folder of the study's data.
    """
    need_play()
    from swarm_pz.play.studies.folder import StudyFolder

    opened = StudyFolder(folder)
    study = opened.study
    rows = [opened.summary(number) | {"code": opened.codes[number]} for number in range(study.participants)]
    printing.print_status(study.title, rows)
    done = sum(row["step"] == "all done" for row in rows)
    print(f"{done} of {study.participants} participants have done all")


def withdraw(code: Annotated[str, tyro.conf.Positional], /, folder: Path = Path("runs/study")) -> None:
    """Delete all data of a participant who withdraws; see docs/studies.md.

    Args:
        code: The participant's code.
        folder: Folder of the study's data; stop its server first.
    """
    need_play()
    from swarm_pz.play.studies.withdrawal import withdraw as delete

    name, recordings = delete(folder, code)
    print(f"{name} has withdrawn: deleted are their answers, times and results, and {recordings} recordings")
    print("an export that was made before still has them: make it again with --overwrite")


def tables(
    folder: Annotated[Path, tyro.conf.Positional],
    /,
    out: Path = Path("runs/tables"),
) -> None:
    """Turn a folder of recorded games into a table: a row for each seat of each game.

    Args:
        folder: Folder of recordings.
        out: Folder to write the table and its schema to.
    """
    need_play()
    from swarm_pz.play.recordings import tables as tables_of

    rows, faults = tables_of.read_folder(folder)
    for fault in faults:
        print(f"left out: {printing.printable(fault)}", file=sys.stderr)
    for path in tables_of.write_tables(rows, out, command()):
        print(path)


def export(
    folder: Annotated[Path, tyro.conf.Positional], /, out: Path = Path("runs/export"), overwrite: bool = False
) -> None:
    """Write a study's data as tables for other programs, and compare its conditions; see docs/data.md.

    Args:
        folder: Folder of the study's data; the study may still be running.
        out: Folder to write to.
        overwrite: Replace an export that is already there.
    """
    need_play()
    from swarm_pz.play.studies.export import export as write

    with progress("participants", "reading") as show:
        data = write(folder, out, overwrite=overwrite, command=command(), progress=show)
    for fault in data.faults:
        print(f"left out: {printing.printable(fault)}", file=sys.stderr)
    print(f"{len(data.remaining)} participants, {len(data.games)} games, {len(data.forms)} answers and scores")
    print(f"what was found: {out / 'report.md'}")
