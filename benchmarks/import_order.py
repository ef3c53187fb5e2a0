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


def measure(task: str, amount: int) -> tuple[float, float]:
    """Return the speed of one task by the clock and by processor time, in a process whose imports are done."""
    from stable_baselines3 import PPO

    from swarm_pz import GameConfig, ObservationConfig, Simulator
    from swarm_pz.evaluation import play_match
    from swarm_pz.training.vec_env import SwarmVecEnv

    Simulator().reset([0])  # before PyTorch's own threads start
    game = GameConfig(observation=ObservationConfig(grid=10), time_limit=60.0)
    model = PPO("MlpPolicy", SwarmVecEnv(game, 8, seed=0), n_steps=max(8, amount // 8), seed=0, device="cpu")
    play_match(model, "uniform", games=2, config=game.replace(time_limit=2.0))  # compiles
    start, used = time.perf_counter(), time.process_time()
    if task == TASKS[0]:
        model.learn(amount)
        done = model.num_timesteps
    else:
        matches = amount // 128  # one takes a slice or two of the processor's time: too little to measure
        for _ in range(matches):
            play_match(model, "uniform", games=8, config=game)
        done = 8 * matches
    return done / (time.perf_counter() - start), done / (time.process_time() - used)


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
        print(*measure(asked.one[1], asked.steps))
        return
    loops = [multiprocessing.Process(target=busy, daemon=True) for _ in range(asked.busy)]
    for loop in loops:
        loop.start()
    plain = {name: value for name, value in os.environ.items() if not name.startswith(("OMP_", "GOMP_"))}
    for task in TASKS:
        speeds: dict[str, list[list[float]]] = {order: [] for order in ORDERS}
        for _ in range(asked.repeats):
            for order, measured in speeds.items():
                command = [sys.executable, "-m", "benchmarks.import_order", "--steps", str(asked.steps)]
                command += ["--one", order, task]
                found = subprocess.run(command, env=plain, check=True, capture_output=True, text=True)  # noqa: S603
                measured.append([float(word) for word in found.stdout.split()[-2:]])
        for i, by in enumerate(("the clock", "processor time")):
            first, last = (statistics.median(pair[i] for pair in measured) for measured in speeds.values())
            ratio = f"{first:.3g} / {last:.3g} = {first / last:.2f}"
            print(f"{task}, by {by}: {' / '.join(ORDERS)} = {ratio}", flush=True)


if __name__ == "__main__":
    main()
