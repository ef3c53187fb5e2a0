"""What policies win against the generator's opponents, all scripts and learned policies.

python -m benchmarks.generated veteran finisher > docs/tables/generated.csv
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterator

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.match import MatchResult, play_match
from swarm_pz.policies.generated import TEST, TRAINING, hide
from swarm_pz.policies.scripted import SCRIPTS
from swarm_pz.policy import load

LEARNED = ("hunter", "selfplay", "champion", "veteran")
SEED = 2_036
"""Of all games: common to all policies, and of no training."""


def matches(policy: str, games: int) -> Iterator[tuple[str, str, MatchResult]]:
    """Play opponent after opponent, `hide` in ten times as many games: what each is, its name and the match."""
    config = GameConfig()
    for what, kinds in (("to train with", TRAINING), ("to test with", TEST), ("script", SCRIPTS)):
        for kind in kinds:
            count = 10 * games if kind is hide else games
            match = play_match(load(policy, config), kind(config), games=count, seed=SEED, config=config)
            yield what, kind.__name__, match
    for name in LEARNED:
        if name != policy:
            yield "learned", name, play_match(load(policy, config), name, games=2 * games, seed=SEED, config=config)


def main() -> None:
    """Play and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policies", nargs="+")
    parser.add_argument("--games", type=int, default=100)
    asked = parser.parse_args()
    write = csv.writer(sys.stdout, lineterminator="\n").writerow
    write(["policy", "against", "which is", "won", "drawn", "lost", "won (95 %)", "median s"])
    for policy in asked.policies:
        for what, name, match in matches(policy, asked.games):
            found = match.summary()
            counts = [found[key] for key in ("wins", "draws", "losses")]
            between = "{:.3f} to {:.3f}".format(*found["win_rate_ci95"])
            median = found["median_seconds"]
            write([policy, name, what, *counts, between, "" if median is None else f"{median:.0f}"])
            sys.stdout.flush()


if __name__ == "__main__":
    main()
