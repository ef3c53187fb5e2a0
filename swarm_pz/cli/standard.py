"""The command that measures a policy by the standard, and checks such reports: ``benchmark``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swarm_pz.cli.interruption import goes_on_with, stops_at_safe_points
from swarm_pz.cli.player_options import Players
from swarm_pz.cli.printing import printable
from swarm_pz.cli.report import command, need, print_rules, progress, say
from swarm_pz.config.base import check


def benchmark(
    policies: Players = (),
    /,
    out: Path = Path("runs/benchmark"),
    name: str = "",
    baseline: Path | None = None,
    processes: int = 2,
    ray: str | None = None,
    quick: bool = False,
    verify: Path | None = None,
    games: int = 40,
    seed: int | None = None,
) -> None:
    """Measure a method by the standard, and write a report that others can check: see docs/benchmark.md.

    What was stopped goes on where it was.

    Args:
        policies: Names of policies, or folders that training wrote: one of each training seed of the method. With
            verify: those of the report, if it does not hold them.
        out: Folder of the report: index.html, report.json and games.jsonl.
        name: What tables call the method; the first policy's name if none is given.
        baseline: Folder of another method's report, to compare with.
        processes: Processes that share the games and the exploiters' training.
        ray: Share them among the machines of a Ray cluster instead: auto, or HOST:PORT.
        quick: Play few and short games, which say whether all of it works, and nothing about the policy.
        verify: Folder of a report to check instead; a sample of its games is played again.
        games: Games of that sample.
        seed: Seed of that sample; a fresh one if none is given.
    """
    need("train", "cma", "filelock", "safetensors", "stable_baselines3", "torch")
    from swarm_pz.evaluation.workers import open_pool
    from swarm_pz.standard import Entry, Protocol, run
    from swarm_pz.standard import verify as verify_report

    if verify is not None:
        check(not (quick or baseline or name), "verify", str(verify), "given without name, baseline and quick")
        verdict = verify_report(verify, policies, games=games, seed=seed, say=say)
        report = verdict.report
        print(
            f"report of {report['name']!r}: files, figures and policies are as they were written, {report['signature']}"
        )
        print(printable(f"{verdict.check} (sample of seed {verdict.seed})"))
        for what in verdict.unchecked:
            print(f"not checked: {printable(what)}")
        if verdict.is_try:
            print("this is a try (--quick) and no entry: it says nothing about the policies, and no board takes it")
        return
    check(len(policies) > 0, "policies", policies, "at least one name or folder")
    check(seed is None, "seed", seed, "left out without verify, since the protocol has its own")
    protocol = Protocol.read()
    if quick:
        protocol = protocol.quick()
    entry = Entry(policies=policies, name=name or Path(policies[0]).name)
    with (
        goes_on_with(command()),
        open_pool(processes, ray) as pool,
        progress() as show,
        stops_at_safe_points() as should_stop,
    ):
        report = run(
            entry,
            out,
            protocol=protocol,
            baseline=baseline,
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
    """Return an interval in brackets; nothing where all games ended alike, and there was nothing to draw from."""
    low, high = ends
    return f" ({of}{low:.3f} to {high:.3f})" if high > low else ""


def _print(report: dict[str, object], out: Path) -> None:
    figures = report["figures"]
    assert isinstance(figures, dict)  # noqa: S101  (for the type checker)
    from swarm_pz.standard.figures import forfeits_of

    for track, told in figures["tracks"].items():
        said = f"worst {told['worst']['score']:.3f} ({told['worst']['opponent']}), worst quarter {told['cvar']:.3f}"
        gain = f", {told['open_loop']['gain']:+.3f} over the clock alone" if told["open_loop"] else ""
        print(f"{track:<10} {told['score']:.3f}{_interval(told['score_ci95'])}; {said}{gain}")
    for one in figures["left_out"]:
        print(f"left out: {one['opponent']} of track {one['track']} is policy {one['policy']} itself")
    over = f"95 % interval over {figures['interval_over']}: "
    print(f"{'score':<10} {figures['score']:.3f}{_interval(figures['score_ci95'], over)}")
    forfeited, count, reason = forfeits_of(figures)
    if forfeited:
        print(printable(f"forfeits: {forfeited} of {count} games, the first since {reason}"))
    if "improvement" in figures:
        better = figures["improvement"]
        low, high = better["ci95"]
        print(f"better than {better['over']} with probability {better['probability']:.3f} ({low:.3f} to {high:.3f})")
    print(f"report: {out / 'index.html'}, {out / 'report.json'}, {out / 'games.jsonl'}")
