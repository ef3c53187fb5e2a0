"""The command that measures a policy by the standard: ``benchmark``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swarm_pz.cli.interruption import goes_on_with, stops_at_safe_points
from swarm_pz.cli.options import WORKERS, WorkerOptions
from swarm_pz.cli.player_options import Players
from swarm_pz.cli.printing import printable
from swarm_pz.cli.report import command, need, print_rules, progress, say
from swarm_pz.config.base import check, check_count


def benchmark(
    policies: Players = (),
    /,
    out: Path = Path("runs/benchmark"),
    name: str = "",
    workers: WorkerOptions = WORKERS,
    quick: bool = False,
    attack_steps: int | None = None,
) -> None:
    """Run the benchmark on a method, and write a report: see docs/benchmark.md.

    The same command continues a stopped run.

    Args:
        policies: Names of policies, or folders that training wrote: one for each training seed of the method.
        out: Folder of the report: index.html, report.json and games.jsonl.
        name: Name of the method in tables; by default, the first policy's name.
        quick: Play a few short games, to check that everything works; they say nothing about the policy.
        attack_steps: Play only the attacks, with exploiters that each learn from this many commands.
    """
    need("train", "cma", "filelock", "safetensors", "stable_baselines3", "torch")
    from swarm_pz.standard import Entry, Protocol, run

    check(len(policies) > 0, "policies", policies, "at least one name or folder")
    protocol = Protocol.read()
    if quick:
        protocol = protocol.quick()
    if attack_steps is not None:
        check_count(attack_steps, "attack_steps", 1, 10**12)
        protocol = protocol.attacks_alone(attack_steps)
    entry = Entry(policies=policies, name=name or Path(policies[0]).name)
    with (
        goes_on_with(command()),
        workers.open() as pool,
        progress() as show,
        stops_at_safe_points() as should_stop,
    ):
        report = run(
            entry,
            out,
            protocol=protocol,
            pool=pool,
            progress=show,
            should_stop=should_stop,
            say=say,
            command=command(),
        )
    print(f"protocol: {protocol.version}, {protocol.digest}")
    print_rules(protocol.game)
    _print(report, out)


def _interval(ends: Sequence[float], of: str = "") -> str:
    """Return an interval in brackets, or nothing if it has no width because all games ended alike."""
    low, high = ends
    return f" ({of}{low:.3f} to {high:.3f})" if high > low else ""


def _print(report: dict[str, object], out: Path) -> None:
    figures = report["figures"]
    assert isinstance(figures, dict)  # noqa: S101  (for the type checker)
    from swarm_pz.standard.figures import forfeits_of

    for track, result in figures["tracks"].items():
        late = "" if result["late"] is None else f", a command late {result['late']:.3f}"
        details = f"worst {result['worst']['score']:.3f} ({printable(result['worst']['opponent'])}){late}"
        gain = f", {result['open_loop']['gain']:+.3f} over the clock alone" if result["open_loop"] else ""
        print(f"{track:<10} {result['score']:.3f}{_interval(result['score_ci95'])}; {details}{gain}")
    over = f"95 % interval over {figures['interval_over']}: "
    print(f"{'score':<10} {figures['score']:.3f}{_interval(figures['score_ci95'], over)}")
    forfeited, count, reason = forfeits_of(figures)
    if forfeited:
        print(printable(f"forfeits: {forfeited} of {count} games, the first since {reason}"))
    print(f"report: {out / 'index.html'}, {out / 'report.json'}, {out / 'games.jsonl'}")
