"""swarm-pz beside other multi-agent simulators: same run, same cores, each at its best batch size.

What is counted differs, and the table says so: a drone-step of ours holds an optimal-control solve
with a look-ahead, three ticks of physics and the rules of capture; an agent-step of theirs is one
agent for one step of their world. Every contender runs in a process of its own, is compiled and
warmed up, and takes random actions that were made beforehand; then the contenders take turns.

    scripts/peers        # makes an environment of its own, since peers need other versions than we
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

SECONDS = 1.5
"""Shortest time that one measurement takes."""

SIZES = (1, 16, 64, 256, 1024, 4096)
"""Numbers of games at once, of which the fastest counts."""

ANSWER = "swarm-pz peers: "
"""Begins the lines that a contender's process answers with; libraries print what they like."""

Step = Callable[[], object]


def swarm_pz(games: int, threads: int) -> tuple[Step, int]:
    """Return a function that plays one second of E games, and the drone-steps in it."""
    from swarm_pz.simulator import CheckedCommands, Simulator

    simulator = Simulator(num_games=games, threads=threads)
    simulator.reset(range(games))
    commands = np.random.default_rng(0).random((16, games, 2, 10, 10))
    taken = 0

    def step() -> None:
        nonlocal taken
        ended = np.flatnonzero(simulator.decided)
        if len(ended):
            simulator.reset(ended + taken, ended)
        simulator.advance(30, CheckedCommands(commands[taken % 16]))
        taken += 1

    return step, games * simulator.config.num_drones * 10


def swarm_pz_in_jax(games: int, threads: int) -> tuple[Step, int]:
    """Return a function that plays one second of E games in JAX, with observations, and the drone-steps in it."""
    from swarm_pz.config import GameConfig, ObservationConfig
    from swarm_pz.jax.speed import make_jax_step

    config = GameConfig(observation=ObservationConfig(grid=10))
    return make_jax_step(config, games, threads), games * config.num_drones * 10


def vmas(scenario: str, games: int, threads: int, **arguments: Any) -> tuple[Step, int]:
    """Return a function that takes 10 steps of a VMAS scenario, and the agent-steps in them."""
    import torch
    from vmas import make_env

    torch.set_num_threads(threads)
    env = make_env(scenario=scenario, num_envs=games, device="cpu", continuous_actions=True, seed=0, **arguments)
    actions = [[env.get_random_action(agent) for agent in env.agents] for _ in range(10)]

    def step() -> None:
        for action in actions:
            env.step(action)

    return step, games * len(env.agents) * len(actions)


def magent_battle(_games: int, _threads: int) -> tuple[Step, int]:
    """MAgent2 battle, 81 against 81, one game."""
    from magent2.environments import battle_v4

    env = battle_v4.parallel_env()
    generator = np.random.default_rng(0)
    actions = [dict(zip(env.possible_agents, row, strict=True)) for row in generator.integers(21, size=(20, 162))]

    def step() -> None:
        env.reset(seed=0)
        for action in actions:
            env.step({agent: action[agent] for agent in env.agents})

    return step, len(env.possible_agents) * len(actions)


def jaxmarl(name: str, games: int, _threads: int) -> tuple[Step, int]:
    """Return a function that takes 32 steps of a JaxMARL environment, by all cores, and the agent-steps in them."""
    import jax
    from jaxmarl import make

    env: Any = make(name)
    steps = 32
    keys = jax.random.split(jax.random.PRNGKey(0), games)
    _, state = jax.vmap(env.reset)(keys)

    def draw(key: Any) -> Any:
        return {
            agent: jax.vmap(jax.vmap(env.action_space(agent).sample))(jax.random.split(part, (steps, games)))
            for agent, part in zip(env.agents, jax.random.split(key, len(env.agents)), strict=True)
        }

    actions = draw(jax.random.PRNGKey(1))

    @jax.jit
    def roll(keys: Any, state: Any) -> Any:
        def advance(carry: Any, action: Any) -> Any:
            keys, state = carry
            split = jax.vmap(jax.random.split)(keys)
            observations, state, rewards, _, _ = jax.vmap(env.step)(split[:, 0], state, action)
            # What is not used is not computed, so a trace of every output is kept.
            used = sum(leaf.sum() for leaf in jax.tree.leaves((observations, rewards)))
            return (split[:, 1], state), used

        return jax.lax.scan(advance, (keys, state), actions)

    def step() -> None:
        jax.block_until_ready(roll(keys, state))

    return step, games * len(env.agents) * steps


ELEVEN = {"n_blue_agents": 10, "n_red_agents": 10, "ai_red_agents": False, "ai_blue_agents": False}
CONTENDERS: dict[str, tuple[Callable[..., tuple[Step, int]], str, str, tuple[int, ...]]] = {
    "swarm-pz": (swarm_pz, "10 against 10", "drone-steps: a control solve, 3 ticks, captures", SIZES),
    "swarm-pz in JAX": (swarm_pz_in_jax, "10 against 10", "drone-steps, and what both sides see", SIZES),
    "VMAS football": (partial(vmas, "football", **ELEVEN), "10 against 10", "agent-steps", (64, 512, 2048)),
    "VMAS simple_tag": (partial(vmas, "simple_tag"), "3 against 1", "agent-steps", (512, 4096, 16384)),
    "MAgent2 battle": (magent_battle, "81 against 81", "agent-steps", (1,)),
    "JaxMARL MPE_simple_tag": (
        partial(jaxmarl, "MPE_simple_tag_v3"), "3 against 1", "agent-steps", (*SIZES, 16384)
    ),
    "JaxMARL SMAX": (partial(jaxmarl, "SMAX"), "5 against 5", "agent-steps", SIZES),
}  # fmt: skip
"""Name: what makes it of a number of games and of threads, its teams, what is counted, batch sizes to choose from."""


def rate(step: Step, count: int) -> float:
    """Return how many agent-steps a second are taken."""
    began, calls = time.perf_counter(), 0
    while time.perf_counter() - began < SECONDS:
        step()
        calls += 1
    return count * calls / (time.perf_counter() - began)


def contend(name: str, threads: int) -> None:
    """Be one contender: find the best batch size, then measure once for every line of input."""
    make, _, _, sizes = CONTENDERS[name]
    found = []
    for games in sizes:
        step, count = make(games, threads)
        step()  # compiles
        found.append((rate(step, count), games, step, count))
    _, best, step, count = max(found, key=lambda entry: entry[0])
    rates = {games: at_size for at_size, games, _, _ in found}
    print(ANSWER + json.dumps({"games": best, "rates": rates}), flush=True)
    for _ in sys.stdin:
        print(ANSWER + json.dumps({"rate": rate(step, count)}), flush=True)


class Contender:
    """A contender's process."""

    def __init__(self, name: str, threads: int) -> None:
        self.rates: list[float] = []
        self._process = subprocess.Popen(  # noqa: S603  (ourselves)
            [sys.executable, "-m", "benchmarks.peers", "--contend", name, "--threads", str(threads)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=os.environ | {"OMP_NUM_THREADS": str(threads)},
        )
        if self._process.stdin is None or self._process.stdout is None:
            raise RuntimeError("the process has no pipes")
        self._input, self._output = self._process.stdin, self._process.stdout
        told = self._answer()
        self.games: int = told["games"]
        self.rates_of_sizes: dict[str, float] = told["rates"]

    def _answer(self) -> dict[str, Any]:
        for line in self._output:  # libraries print what they like before
            if line.startswith(ANSWER):
                answer: dict[str, Any] = json.loads(line.removeprefix(ANSWER))
                return answer
        raise RuntimeError("it ended early; run it alone with --contend to see why")

    def measure(self) -> None:
        """Take one measurement."""
        self._input.write("\n")
        self._input.flush()
        self.rates.append(float(self._answer()["rate"]))

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()


def plot(rows: list[dict[str, Any]], path: Path) -> None:
    """Draw the medians as bars, with their ranges, and the rates over the number of games."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 6), layout="constrained")
    axes, over = figure.subplots(2)
    rows = rows[::-1]
    medians, lows, highs = (np.array([row[key] for row in rows]) / 1e6 for key in ("median", "low", "high"))
    colours = ["#1d62d6" if row["name"].startswith("swarm-pz") else "#9aa3ad" for row in rows]
    bars = axes.barh([row["name"] for row in rows], medians, xerr=[medians - lows, highs - medians], color=colours)
    axes.bar_label(bars, [f" {median:.2f}" for median in medians])
    axes.set_xlabel("million agent-steps a second\n(of swarm-pz: drone-steps, each with a solve)")
    axes.margins(x=0.1)
    for row in rows[::-1]:
        sizes = [int(games) for games in row["rates"]]
        over.loglog(sizes, [rate / 1e6 for rate in row["rates"].values()], marker="o", markersize=4, label=row["name"])
    over.set(xlabel="games at once", ylabel="million a second")
    over.legend(fontsize="small", frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
    for part in (axes, over):
        part.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=120)


def main() -> None:
    """Let the contenders take turns; print a table, write JSON and a bar chart."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--out", type=Path, default=Path("runs/peers"))
    parser.add_argument("--contend", choices=CONTENDERS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.contend:
        contend(options.contend, options.threads)
        return
    contenders: dict[str, Contender] = {}
    for name in CONTENDERS:
        print(f"preparing {name}", flush=True)
        try:
            contenders[name] = Contender(name, options.threads)
        except RuntimeError as error:
            print(f"  left out: {error}", flush=True)
    for _ in range(options.repeats):
        for name in list(contenders):
            try:
                contenders[name].measure()
            except (OSError, RuntimeError) as error:
                print(f"{name} is left out: {error}", flush=True)
                contenders.pop(name).close()
    rows = []
    print("| simulator | teams | games at once | million a second | range | counted |\n|---|---|---|---|---|---|")
    for name, contender in contenders.items():
        contender.close()
        _, teams, counted, _ = CONTENDERS[name]
        median, low, high = statistics.median(contender.rates), min(contender.rates), max(contender.rates)
        rates = contender.rates_of_sizes
        rows.append(
            {"name": name, "games": contender.games, "median": median, "low": low, "high": high, "rates": rates}
        )
        print(
            f"| {name} | {teams} | {contender.games} | {median / 1e6:.2f} "
            f"| {low / 1e6:.2f} to {high / 1e6:.2f} | {counted} |"
        )
    print(f"\n| games at once | {' | '.join(map(str, SIZES))} |\n|---{'|---' * len(SIZES)}|")
    for row in rows:
        told = [f"{row['rates'][str(games)] / 1e6:.3f}" if str(games) in row["rates"] else "" for games in SIZES]
        print(f"| {row['name']} | {' | '.join(told)} |")
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "peers.json").write_text(json.dumps({"threads": options.threads, "rows": rows}, indent=2) + "\n")
    plot(rows, options.out / "peers.png")


if __name__ == "__main__":
    main()
