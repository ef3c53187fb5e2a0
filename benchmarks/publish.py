"""Measure a learned tactic and put it into the zoo, with the figures on its card.

python -m benchmarks.publish runs/first hunter --about "Best against uniform coverage."
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.policies.scripted import SCRIPTS

ZOO = Path(policies.__file__).parent / "zoo"
SIZES = (5, 10, 20, 40)


def measure(folder: Path, games: int, seed: int) -> dict[str, Any]:
    """Play a tactic against every script, and at other sizes against uniform coverage beside `ring`."""

    def figures(policy: Any, opponent: str, config: GameConfig) -> dict[str, Any]:
        match = play_match(policy, opponent, games=games, seed=seed, config=config, threads=2)
        print(f"{match.policy} against {opponent}, {config.num_drones} drones: {match.standing()}", flush=True)
        keys = ("games", "wins", "draws", "losses", "win_rate_ci95", "median_seconds", "restricted_mean_seconds")
        return {key: match.summary()[key] for key in keys}

    def load(config: GameConfig) -> LearnedPolicy:
        return LearnedPolicy.read(folder, config)

    rules = GameConfig()
    against = {script.__name__: figures(load(rules), script.__name__, rules) for script in SCRIPTS}
    sizes = {}
    for size in SIZES:
        config = GameConfig(drones_per_team=size)
        sizes[str(size)] = {
            "tactic": figures(load(config), "uniform", config),
            "ring": figures("ring", "uniform", config),
        }
    return {"seed": seed, "against": against, "uniform_at_sizes": sizes}


def main() -> None:
    """Measure and publish."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, help="folder that training wrote")
    parser.add_argument("name", help="what the tactic is called from now on")
    parser.add_argument("--about", required=True, help="one line about it")
    parser.add_argument("--after", nargs="*", default=[], help="commands that made what it was grown from, in order")
    parser.add_argument("--note", help="what else to know about how it came to be")
    parser.add_argument("--games", type=int, default=200, help="games of each match")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    trained = LearnedPolicy.read(options.run, GameConfig())
    results = measure(options.run, options.games, options.seed)
    card = trained.card | {"about": options.about, "results": results}
    if options.note:
        card["note"] = options.note
    # Folders are named as seen from here: where this is on the machine concerns nobody.
    here = f"{Path.cwd()}/"
    card["command"] = "; ".join([*options.after, card["command"]]).replace(here, "")
    card["training"] = card["training"] | {"start_from": card["training"]["start_from"].replace(here, "")}
    LearnedPolicy(card, trained.weights(), GameConfig(), options.name).write(ZOO / options.name)
    print(f"{ZOO / options.name} is written; its name needs an entry point in pyproject.toml")


if __name__ == "__main__":
    main()
