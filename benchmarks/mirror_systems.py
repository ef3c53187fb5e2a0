"""Control systems beside their slow references, and in extreme states.

python -m benchmarks.mirror_systems
"""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path

import tests.systems
from swarm_pz.config.registry import registered
from tests.systems.flights import find_not_finite

BOUND = 1e-4
"""What an acceleration may differ by, of the largest in its state."""


def main() -> None:
    """Print how far each system is from its reference, and in how many extreme states it is not finite."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--compared", type=int, default=500, help="random states beside each reference")
    parser.add_argument("--states", type=int, default=100_000, help="extreme states of each system")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--systems", nargs="*", default=sorted(registered()))
    arguments = parser.parse_args()
    folder, failed = Path(tests.systems.__path__[0]), False
    for name in arguments.systems:
        said = "no reference"
        if (folder / f"reference_{name}.py").is_file():
            reference = importlib.import_module(f"tests.systems.reference_{name}")
            worst = reference.compare(arguments.compared, arguments.seed)
            said = f"{worst:.1e} of the largest acceleration in {arguments.compared} states"
            failed |= not worst < BOUND
        broken = find_not_finite(name, arguments.states, arguments.seed)
        print(f"{name:<16} {said}; {broken} of {arguments.states:,} extreme states are not finite", flush=True)
        failed |= broken > 0
    if failed:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
