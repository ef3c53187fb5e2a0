"""Games of a tactic as a Minari dataset, by Minari's own `DataCollector`.

pip install "minari[hdf5]>=0.5.4"
python examples/minari_dataset.py --tactic ring --opponent uniform --games 20
"""

from __future__ import annotations

import argparse

import gymnasium
import minari
import numpy as np

from swarm_pz import GameConfig, ObservationConfig
from swarm_pz.policies import load

ROW = np.zeros(1, np.int64)


def main() -> None:
    """Play games one after the other, and write what the tactic's side saw, sent and got."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--tactic", default="ring")
    parser.add_argument("--opponent", default="uniform")
    parser.add_argument("--games", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=300.0, help="of a game")
    parser.add_argument("--name", default="swarm/ring-v0")
    options = parser.parse_args()
    game = GameConfig(time_limit=options.seconds, observation=ObservationConfig(grid=10))
    tactic = load(options.tactic, game)
    # Plain values, since Minari writes the keywords into the dataset, to make the environment from them again.
    keywords = {"config": game.to_dict(), "opponent": options.opponent, "action": "command"}
    env = minari.DataCollector(gymnasium.make("swarm_pz/Capture-v0", **keywords))
    duel = env.unwrapped.duel
    for seed in range(options.games):
        env.reset(seed=seed)
        tactic.reset([seed], ROW)
        over = False
        while not over:
            action = duel.batch.ask(tactic, duel.sides, ROW)[0].astype(np.float32)
            *_, terminated, truncated, _ = env.step(action)
            over = terminated or truncated
    dataset = env.create_dataset(options.name, algorithm_name=options.tactic, code_permalink=None, description=__doc__)
    env.close()
    print(f"{dataset.total_episodes} games, {dataset.total_steps} steps: {dataset.storage.data_path}")


if __name__ == "__main__":
    main()
