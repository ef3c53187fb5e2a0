"""The table under load, and how fast it answers: a server in a process of its own, its clients in this one.

python -m benchmarks.table load --seconds 60          30 rooms, two clients each
python -m benchmarks.table latency --sends 200        a page: from pointer-up to what is seen
python -m benchmarks.table smooth --drones 100        a page: gaps between paintings
python -m benchmarks.table soak --seconds 3600        10 rooms with clients that drop, return, flood and send garbage
python -m benchmarks.table attack --seconds 10        a room's frames while five clients do their worst
"""

from __future__ import annotations

import argparse
import asyncio
import json

from benchmarks.table.attack import attack
from benchmarks.table.load import load, soak
from benchmarks.table.page import latency, smooth


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["load", "attack", "latency", "smooth", "soak"])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--sends", type=int, default=200)
    parser.add_argument("--drones", type=int, default=10, help="a team")
    parser.add_argument("--attacks", nargs="*", default=(), help="of the attack's cases; else all")
    parser.add_argument("--learned", default="champion")
    options = parser.parse_args()
    match options.what:
        case "load":
            asyncio.run(load(options.seconds, options.learned))
        case "attack":
            asyncio.run(attack(options.seconds, options.drones, options.attacks))
        case "soak":
            print(json.dumps(asyncio.run(soak(options.seconds)), indent=2))
        case "latency":
            latency(options.sends)
        case "smooth":
            smooth(options.drones, options.seconds)


if __name__ == "__main__":
    main()
