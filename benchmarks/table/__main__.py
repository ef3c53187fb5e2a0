"""The table under load, and how fast it answers: a server in a process of its own, its clients in this one.

python -m benchmarks.table load --seconds 60          30 rooms, two clients each
python -m benchmarks.table latency --sends 200        a page: from pointer-up to what is seen
python -m benchmarks.table smooth --drones 100        a page: gaps between paintings
python -m benchmarks.table soak --seconds 3600        10 rooms with clients that drop, return, flood and send garbage
python -m benchmarks.table begin                      every policy: how long it loads, and its first command
python -m benchmarks.table attack --seconds 10        a room's frames while five clients do their worst
python -m benchmarks.table rings --games 20           a page: draws rings as slowly as a person, against uniform
"""

from __future__ import annotations

import argparse
import asyncio
import json

from benchmarks.table.attack import attack
from benchmarks.table.load import begin, load, soak
from benchmarks.table.page import latency, rings, smooth


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["load", "attack", "latency", "smooth", "soak", "begin", "rings"])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--sends", type=int, default=200)
    parser.add_argument("--drones", type=int, default=10, help="a team")
    parser.add_argument("--games", type=int, default=20)
    parser.add_argument("--attacks", nargs="*", default=(), help="of the attack's cases; else all")
    parser.add_argument("--learned", default="champion")
    options = parser.parse_args()
    if options.what == "load":
        asyncio.run(load(options.seconds, options.learned))
    elif options.what == "attack":
        asyncio.run(attack(options.seconds, options.drones, options.attacks))
    elif options.what == "soak":
        print(json.dumps(asyncio.run(soak(options.seconds)), indent=2))
    elif options.what == "begin":
        asyncio.run(begin())
    elif options.what == "latency":
        latency(options.sends)
    elif options.what == "smooth":
        smooth(options.drones, options.seconds)
    else:
        rings(options.games)


if __name__ == "__main__":
    main()
