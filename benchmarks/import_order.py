"""Speed where PyTorch is imported before swarm_pz and after it, beside busy loops, in turn.

python -m benchmarks.import_order
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import statistics
import subprocess
import sys
import time

ORDERS = {
    "PyTorch first": ("stable_baselines3", "swarm_pz.training.vec_env"),
    "swarm_pz first": ("swarm_pz.training.vec_env", "stable_baselines3"),
}
TASKS = ("PPO, steps a second", "a match, games a second")


def busy() -> None:
    """Keep a core busy."""
    while True:
        pass


def measure(task: str, amount: int) -> float:
    """Return the speed of one task, in a process whose imports are done."""
    from stable_baselines3 import PPO

    from swarm_pz import GameConfig, ObservationConfig, Simulator
    from swarm_pz.evaluation import play_match
    from swarm_pz.training.vec_env import SwarmVecEnv

    Simulator().reset([0])  # before PyTorch's own threads start
    game = GameConfig(observation=ObservationConfig(grid=10), time_limit=60.0)
    model = PPO("MlpPolicy", SwarmVecEnv(game, 8, seed=0), n_steps=max(8, amount // 8), seed=0, device="cpu")
    play_match(model, "uniform", games=2, config=game.replace(time_limit=2.0))  # compiles
    start = time.perf_counter()
    if task == TASKS[0]:
        model.learn(amount)
        return model.num_timesteps / (time.perf_counter() - start)
    play_match(model, "uniform", games=8, config=game)
    return 8 / (time.perf_counter() - start)


def main() -> None:
    """Measure both orders in turn, and print medians and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--busy", type=int, default=2, help="busy loops beside")
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--steps", type=int, default=2048, help="of PPO")
    parser.add_argument("--one", nargs=2, metavar=("ORDER", "TASK"), help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        for module in ORDERS[asked.one[0]]:
            __import__(module)
        print(measure(asked.one[1], asked.steps))
        return
    loops = [multiprocessing.Process(target=busy, daemon=True) for _ in range(asked.busy)]
    for loop in loops:
        loop.start()
    plain = {name: value for name, value in os.environ.items() if not name.startswith(("OMP_", "GOMP_"))}
    for task in TASKS:
        speeds: dict[str, list[float]] = {order: [] for order in ORDERS}
        for _ in range(asked.repeats):
            for order, measured in speeds.items():
                command = [
                    sys.executable,
                    "-m",
                    "benchmarks.import_order",
                    "--steps",
                    str(asked.steps),
                    "--one",
                    order,
                    task,
                ]
                found = subprocess.run(command, env=plain, check=True, capture_output=True, text=True)  # noqa: S603
                measured.append(float(found.stdout.split()[-1]))
        first, last = (statistics.median(measured) for measured in speeds.values())
        print(f"{task}: " + ", ".join(f"{order} {statistics.median(v):.3g}" for order, v in speeds.items()))
        print(f"  PyTorch first / swarm_pz first: {first / last:.2f}")


if __name__ == "__main__":
    main()
