"""Control systems beside their slow references, and in extreme states.

python -m benchmarks.mirror_systems
"""

from __future__ import annotations

import argparse

import numpy as np

from swarm_pz.config.registry import registered
from tests.systems.flights import find_not_finite
from tests.systems.references import COMPARED

BOUND = 1e-4
"""Largest difference of an acceleration, as a share of the largest in its state."""


def main() -> None:
    """Print how far each system is from its reference, and in how many extreme states it is not finite."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--compared", type=int, default=500, help="random states beside each reference")
    parser.add_argument("--states", type=int, default=100_000, help="extreme states of each system")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--systems", nargs="*", default=sorted(registered()))
    arguments = parser.parse_args()
    failed = False
    for name in arguments.systems:
        said = "no reference"
        if name in COMPARED:
            generator = np.random.default_rng(arguments.seed)
            worst = max(COMPARED[name](generator, number) for number in range(arguments.compared))
            said = f"{worst:.1e} of the largest acceleration in {arguments.compared} states"
            failed |= not worst < BOUND
        broken = find_not_finite(name, arguments.states, arguments.seed)
        print(f"{name:<16} {said}; {broken} of {arguments.states:,} extreme states are not finite", flush=True)
        failed |= broken > 0
    if failed:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
