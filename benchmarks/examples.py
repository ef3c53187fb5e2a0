"""Other libraries learn: runs the files of `examples/` that train, and writes a table of what came of it.

scripts/examples              # runs those that have no row yet, each in an environment of its own
scripts/examples cleanrl_ppo  # runs this one again
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import io
import json
import os
import re
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[1]
TABLE, ROWS = ROOT / "docs" / "tables" / "examples.csv", ROOT / "docs" / "examples.json"
OPPONENTS = ("noise", "uniform")


class Example(NamedTuple):
    """A file of `examples/`: what it shows, where it runs, and whose versions its row tells."""

    shows: str
    environment: str
    requirements: str
    distributions: tuple[str, ...]

    def python(self) -> Path:
        """Return the interpreter of its environment."""
        return ROOT / self.environment / "bin" / "python"


def _common(shows: str, *distributions: str) -> Example:
    pinned = (*distributions, "gymnasium", "torch")
    return Example(shows, ".venv-compatibility", "benchmarks/compatibility/requirements.txt", pinned)


def _alone(shows: str, library: str, *distributions: str) -> Example:
    pinned = (*distributions, "pettingzoo", "gymnasium", "torch")
    return Example(shows, f".venv-{library}", f"benchmarks/compatibility/{library}-requirements.txt", pinned)


EXAMPLES = {
    "sb3_ppo": _common("Stable-Baselines3: PPO, unwrapped", "stable_baselines3"),
    "sb3_contrib_recurrent_ppo": _common("sb3-contrib: RecurrentPPO, exported as ONNX", "sb3_contrib"),
    "cleanrl_ppo": _common("In the manner of CleanRL: PPO in one file, on gymnasium.make_vec"),
    "torchrl_selfplay": _alone("TorchRL: PPO on PettingZooWrapper, self-play", "torchrl", "torchrl", "tensordict"),
    "benchmarl_selfplay": _alone(
        "BenchMARL: IPPO, a group and a network a side, in self-play", "benchmarl", "benchmarl", "torchrl", "tensordict"
    ),
    "rllib_selfplay": _alone("RLlib: PPO, two policies in self-play, on ParallelPettingZooEnv", "rllib", "ray"),
    "jax_ppo": _alone("JAX: PPO in self-play, games and learning under one jit", "jax", "jax", "optax"),
}


def path_of(name: str) -> Path:
    """Return an example's file."""
    return ROOT / "examples" / f"{name}.py"


def digest_of(name: str) -> str:
    """Return what tells one version of an example's file from another."""
    return hashlib.sha256(path_of(name).read_bytes()).hexdigest()[:16]


def lines_of(name: str) -> int:
    """Count an example's lines that are neither empty nor a comment."""
    lines = (line.strip() for line in path_of(name).read_text().splitlines())
    return sum(bool(line) and not line.startswith("#") for line in lines)


def commands_in(said: str) -> int:
    """Return how many commands an example learned from, as it says itself."""
    (commands,) = re.findall(r"^commands seen: (\d+)$", said, re.MULTILINE)
    return int(commands)


def run(name: str, options: list[str]) -> dict[str, Any]:
    """Make an example's environment, run the example in it, and return its row.

    Raises
    ------
    CalledProcessError
        If either ended with an error, which it has then printed.
    """
    example, out = EXAMPLES[name], ROOT / "runs" / "examples" / name
    settings = {"VENV": example.environment}
    subprocess.run([ROOT / "scripts" / "setup", example.requirements], check=True, env=os.environ | settings)  # noqa: S603
    python = [example.python(), "-u"]
    asked = f"from importlib.metadata import version; print(*map(version, {example.distributions!r}))"
    versions = subprocess.run([*python, "-c", asked], check=True, capture_output=True, text=True).stdout.split()  # noqa: S603
    began, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = os.environ | {"PYTHONPATH": str(ROOT), "CUDA_VISIBLE_DEVICES": ""}
    command = [*python, path_of(name), "--out", out, *options]
    said = ""
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:  # noqa: S603
        for line in process.stdout or ():
            print(line, end="", flush=True)
            said += line
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    matches = {opponent: json.loads((out / f"{opponent}.json").read_text()) for opponent in OPPONENTS}
    return {
        "digest": digest_of(name),
        "versions": dict(zip(example.distributions, versions, strict=True)),
        "lines": lines_of(name),
        "commands": commands_in(said),
        "minutes": round((time.monotonic() - began) / 60, 1),
        "processor_minutes": round((after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / 60, 1),
        "shares": {
            name: [round(value, 4) for value in (match["mean_share"], *match["mean_share_ci95"])]
            for name, match in matches.items()
        },
    }


def table(rows: dict[str, dict[str, Any]]) -> str:
    """Return the table that shows rows, as CSV."""
    file = io.StringIO()
    write = csv.writer(file, lineterminator="\n").writerow
    shares = (f"share against {name}" for name in OPPONENTS)
    write(["example", "shows", "lines", "commands", "minutes (of processor)", *shares, "versions"])
    for name in EXAMPLES:
        if name in rows:
            write(_cells(name, rows[name]))
    return file.getvalue()


def _cells(name: str, row: dict[str, Any]) -> tuple[str, ...]:
    return (
        f"{name}.py",
        EXAMPLES[name].shows,
        str(row["lines"]),
        f"{row['commands']:,}",
        f"{row['minutes']:.1f} ({row['processor_minutes']:.1f})",
        *("{:.2f} [{:.2f}, {:.2f}]".format(*row["shares"][opponent]) for opponent in OPPONENTS),
        ", ".join(f"{library} {version}" for library, version in row["versions"].items()),
    )


def main() -> None:
    """Run examples; write the table as each ends."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", choices=[[], *EXAMPLES], help="which; those without a row if not given")
    parser.add_argument("--seed", default="0")
    asked = parser.parse_args()
    rows = json.loads(ROWS.read_text()) if ROWS.exists() else {}
    todo = asked.names or [name for name in EXAMPLES if rows.get(name, {}).get("digest") != digest_of(name)]
    failed = []
    for name in todo:
        print(f"{name}: {EXAMPLES[name].shows}", flush=True)
        try:
            rows[name] = run(name, ["--seed", asked.seed])
        except subprocess.CalledProcessError as error:
            print(f"{name} ended with {error.returncode}; see above", file=sys.stderr, flush=True)
            failed.append(name)
            continue
        ROWS.write_text(json.dumps(rows, indent=2) + "\n")
        TABLE.write_text(table(rows))
    if failed:
        sys.exit(f"no rows came of {', '.join(failed)}")
    print(f"{TABLE.relative_to(ROOT)} is up to date: {len(todo)} run, {len(rows)} rows")


if __name__ == "__main__":
    main()
