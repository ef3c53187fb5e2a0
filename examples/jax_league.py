"""A league on one accelerator: a learner, learners that exploit it, its past selves, and patterns that evolve.

python examples/jax_league.py --pallas --seconds 550     # made `marshal` on an H200

The output folder is a player: swarm-pz evaluate runs/jax_league --opponent veteran

In each update all games continue for some commands, and the learner and its exploiters learn from them. Every few
updates opponents are drawn again: those against which the learner gets the smallest share come most often.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
import optax
from jax import lax, random
from jax import numpy as jnp
from jax_ppo import LARGEST_GRADIENT, Step, answer, init_critic, learn, log_prob, policy_of

from swarm_pz import GameConfig, ObservationConfig
from swarm_pz.config import AGENTS, BLUE, CHANNELS, MOTION_CHANNELS, RED
from swarm_pz.jax import Params, State, make_params, reset, step
from swarm_pz.jax.network import Weights, decide, density_of, features_of
from swarm_pz.policies import load
from swarm_pz.policies.learned import ANCESTORS, LearnedPolicy, lineage
from swarm_pz.policies.pattern import KINDS, numbers_of, points_of
from swarm_pz.policies.symmetry import ORIENTATIONS
from swarm_pz.spaces.densities import cell_centres
from swarm_pz.training.config import TrainConfig
from swarm_pz.training.pool import Member, Pool

CONFIG = TrainConfig(
    game=GameConfig(observation=ObservationConfig(grid=10, channels=(*CHANNELS, *MOTION_CHANNELS))),
    num_envs=4096,
    rollout=32,
    batch_size=8192,
    epochs=2,
    width=64,
    learning_rate=4e-4,
    gamma=0.995,
    log_std=-2.0,
    final_log_std=-3.0,
)
GIVEN = ["warden", "veteran", "finisher", "champion", "selfplay", "hunter", "scholar"]
EXPLOITERS, SLOTS, PATTERNS = 4, 24, 192
"""Learners that play only against the learner; opponents from the pool at a time; patterns at a time."""
SHARES = (0.125, 0.4375)
"""Shares of the games against exploiters and against the pool. The other games are against patterns."""
LATE = 8
"""In one of so many games, the learner's commands come one command late."""
WARM, DEAL, SNAPSHOT, YOUNG, LIFE = 20, 4, 50, 20, 100
"""Updates in which only the critic learns, and then the learning rate grows; updates between two deals; between two
snapshots; fewest and most updates of an exploiter."""
REMEMBERED, TRIED, EASY = 300.0, 40.0, 0.85
"""Games after which older ones fade; games needed to judge a pattern; and the learner's mean share from which on a
pattern is replaced."""
SECOND = 0.3
"""Largest amplitude of the second harmonic of a pattern's path."""
_X, _Y = (jnp.asarray(axis, jnp.float32) for axis in cell_centres(CONFIG.game.command_cells))


class Learner(NamedTuple):
    """A network with its critic, and its optimizer's state."""

    network: dict[str, Any]
    optimizer: Any


class Games(NamedTuple):
    """All games: their states, what both sides see, and what players remember."""

    states: State
    seen: dict[str, jax.Array]
    held: jax.Array  # the learner's last densities, for late commands
    angles: jax.Array  # directions in which patterns first saw their opponents


class Deal(NamedTuple):
    """The opponents of the pool: networks (SLOTS, ...), and the numbers (games, 17) of patterns."""

    networks: Weights
    patterns: jax.Array


def sections(config: TrainConfig) -> tuple[int, int]:
    """Return the number of games against exploiters, and against networks: exploiters and the pool."""
    first = int(SHARES[0] * config.num_envs) // EXPLOITERS * EXPLOITERS
    return first, first + int(SHARES[1] * config.num_envs) // SLOTS * SLOTS


def optimizer() -> optax.GradientTransformation:
    """Return Adam; the learning rate is multiplied later."""
    return optax.chain(optax.clip_by_global_norm(LARGEST_GRADIENT), optax.scale_by_adam(eps=1e-5))


def learner_of(actor: Weights, key: jax.Array) -> Learner:
    """Return a learner with the given actor and an untrained critic."""
    critic = init_critic(*random.split(key), actor["head.weight"].shape[1], actor["trunk.whole.0.weight"].shape[-1])
    network = {"actor": jax.tree.map(jnp.asarray, actor), "critic": critic}
    return Learner(network, optimizer().init(network))


def improve(config: TrainConfig, learner: Learner, steps: Step, last: jax.Array, key, std, rate, acts):
    """Improve a learner by its rows (T, n, ...), if `acts` is 0 only its critic; return it, and mean figures."""

    def change(gradients, network, state):
        changes, state = optimizer().update(gradients, state)
        changes["actor"] = jax.tree.map(lambda change: acts * change, changes["actor"])
        return optax.apply_updates(network, jax.tree.map(lambda change: -rate * change, changes)), state

    batch = min(config.batch_size, steps.rewards.size // 4)
    learned, metrics = learn(config, tuple(learner), steps, last, key, std, change, batch)
    return Learner(*learned), metrics


def fly(numbers: jax.Array, angle: jax.Array, state: State, params: Params) -> jax.Array:
    """Return a pattern's density (10, 10): as `swarm_pz.policies.pattern`, but on a path of two harmonics."""
    x, y, lean, home, radius, width, along, across, period, start, look, ground, core = numbers[:13]
    turn = 2.0 * jnp.pi * (state.tick // params.step_ticks) / period
    begun = 2.0 * jnp.pi * start + jnp.where(look >= 0.5, angle, 0.0)
    second = jnp.array([jnp.cos(2.0 * turn), jnp.sin(2.0 * turn)])
    u = along * jnp.cos(turn) + numbers[13:15] @ second
    v = across * jnp.sin(turn) + numbers[15:17] @ second
    path = jnp.array([u * jnp.cos(begun) - v * jnp.sin(begun), u * jnp.sin(begun) + v * jnp.cos(begun)])
    place = jnp.array([x, y]) + lean * (mean_of(state, RED) - 0.5) + home * (mean_of(state, BLUE) - 0.5)
    px, py = jnp.clip(place + path, 0.0, 1.0)
    distance = jnp.hypot(_X - px, _Y - py)
    density = jnp.exp(-(((distance - radius) / width) ** 2)) + core * jnp.exp(-((distance / width) ** 2))
    density = ground + density / jnp.maximum(density.max(), 1e-30)
    return density / density.max()


def mean_of(state: State, team: int) -> jax.Array:
    """Return the mean position (2,) of a team."""
    is_its = (state.teams == team)[:, None]
    return jnp.where(is_its, state.positions, 0.0).sum(axis=0) / jnp.maximum(is_its.sum(), 1)


@partial(jax.jit, static_argnames="config")
def begin(config: TrainConfig, key: jax.Array, params: Params) -> Games:
    """Return games at their starts."""
    images, states = jax.vmap(reset, (0, None))(random.split(key, config.num_envs), params)
    cells = config.game.command_cells
    return Games(states, images, jnp.ones((config.num_envs, cells, cells)), jnp.zeros(config.num_envs))


@partial(jax.jit, static_argnames="config", donate_argnames=("main", "exploiters", "games"))
def update(config, main: Learner, exploiters: Learner, games: Games, deal: Deal, params: Params, key, schedule):
    """Play all games for some commands, and learn from what the learner and its exploiters did."""
    std, rate, acts = schedule
    first, second = sections(config)
    red, blue = AGENTS
    is_late = (jnp.arange(config.num_envs) % LATE == 0)[:, None, None]
    to_games, to_main, to_exploiters = random.split(key, 3)

    def by(count: int, values: jax.Array) -> jax.Array:
        return values.reshape(count, -1, *values.shape[1:])

    def act(network, images: jax.Array, key: jax.Array):
        means, values = answer(network, images)
        actions = means + std * random.normal(key, means.shape)
        return actions, log_prob(actions, means, std), values

    def answer_of(weights: Weights, images: jax.Array) -> jax.Array:
        return density_of(decide(weights, features_of(weights, images / np.float32(255))))

    def play(games: Games, key):
        to_main, to_others, to_starts = random.split(key, 3)
        states, images = games.states, games.seen
        own, logs, values = act(main.network, images[red], to_main)
        density = density_of(own)
        begun = (states.tick == 0)[:, None, None]
        command = jnp.where(is_late, jnp.where(begun, 1.0, games.held), density)
        rows = by(EXPLOITERS, images[blue][:first])
        theirs = jax.vmap(act)(exploiters.network, rows, random.split(to_others, EXPLOITERS))
        looks = jax.vmap(mean_of, (0, None))(states, RED) - 0.5
        angles = jnp.where(states.tick == 0, jnp.arctan2(looks[:, 1], looks[:, 0]), games.angles)
        pattern_states = jax.tree.map(lambda values: values[second:], states)
        parts = [
            density_of(theirs[0]),
            jax.vmap(answer_of)(deal.networks, by(SLOTS, images[blue][first:second])),
            jax.vmap(fly, (0, 0, 0, None))(deal.patterns, angles[second:], pattern_states, params)[None],
        ]
        against = jnp.concatenate([part.reshape(-1, *part.shape[2:]) for part in parts])
        starts = random.split(to_starts, config.num_envs)
        after = jax.vmap(step, (0, 0, 0, None))(starts, states, {red: command, blue: against}, params)
        new_images, states, rewards, dones, infos = after
        over = dones["__all__"]
        kept = Step(images[red], own, logs, values, rewards[red], over)
        other = Step(rows, *theirs, by(EXPLOITERS, rewards[blue][:first]), by(EXPLOITERS, over[:first]))
        shares = jnp.where(over, infos["size"][:, 0] / params.sizes.sum(), 0.0)
        return Games(states, new_images, density, angles), (kept, other, over, shares)

    games, (rows, theirs, over, shares) = lax.scan(play, games, random.split(to_games, config.rollout))
    _, last = answer(main.network, games.seen[red])
    main, metrics = improve(config, main, rows, last, to_main, std, rate, acts)
    _, last = jax.vmap(answer)(exploiters.network, by(EXPLOITERS, games.seen[blue][:first]))
    theirs = jax.tree.map(lambda values: values.swapaxes(0, 1), theirs)
    teach = jax.vmap(partial(improve, config), (0, 0, 0, 0, None, None, None))
    exploiters, _ = teach(exploiters, theirs, last, random.split(to_exploiters, EXPLOITERS), std, rate, 1.0)
    return main, exploiters, games, metrics, over.sum(axis=0), shares.sum(axis=0)


@dataclass
class Opponent(Member):
    """A member of a pool with its network, or its numbers as a pattern."""

    content: Any = None

    def add(self, games: float, score: float) -> None:
        """Count games, and the sum of the learner's shares in them."""
        fade = REMEMBERED / max(self.games + games, REMEMBERED)
        self.games, self.score = (self.games + games) * fade, (self.score + score) * fade


def widened(name: str, config: TrainConfig, generator: np.random.Generator) -> Weights:
    """Return a policy's weights for a network with more channels and features that computes the same.

    Features are copied, and the next layer takes a random part of each copy: else copies would learn the same.
    """
    channels, width, weights = len(config.game.observations[0].channels), config.width // ORIENTATIONS, {}
    for key, tensor in load(name, config.game).weights().items():
        values = tensor.numpy()
        if key == "trunk.near.0.weight":  # its last input is the distance from the centre
            values = np.insert(values, [values.shape[1] - 1] * (channels + 1 - values.shape[1]), 0.0, axis=1)
        elif key.endswith("weight"):
            parts = generator.uniform(0.3, 0.7, (width // values.shape[1], *values.shape))
            values = np.concatenate(list(values * parts / parts.sum(axis=0)), axis=1)
        if not key.startswith("head"):
            values = np.tile(values, (width // len(values), *[1] * (values.ndim - 1)))
        weights[key] = jnp.asarray(values, jnp.float32)
    return weights


def new_pattern(parents: list[Opponent], generator: np.random.Generator) -> Opponent:
    """Return a variation of a hard or a named pattern, or a random pattern."""
    kind, named = generator.random(), list(KINDS.values())
    if kind < 0.5 and parents:
        numbers = parents[generator.choice(len(parents), p=Pool(parents).weights(2.0, 0.01))].content
        point = points_of(numbers[None, :13])[0] + generator.choice([0.02, 0.06]) * generator.normal(size=13)
        second = numbers[13:] + generator.choice([0.0, 0.04]) * generator.normal(size=4)
    else:
        point = points_of(np.array([list(named[generator.integers(len(named))].values())]))[0]
        point = generator.random(13) if kind > 0.8 else point + 0.12 * generator.normal(size=13)
        second = generator.choice([0.0, 0.1]) * generator.normal(size=4)
    numbers = np.concatenate([numbers_of(point[None])[0], np.clip(second, -SECOND, SECOND)])
    return Opponent("", "", "pattern", content=numbers)


class Opponents:
    """The opponents and the learner's scores against them; on the host."""

    def __init__(self, config: TrainConfig, generator: np.random.Generator) -> None:
        given = {name: widened(name, config, generator) for name in config.opponents}
        self.networks = [Opponent(name, "", "initial", content=weights) for name, weights in given.items()]
        self.generator = generator
        self.first, self.second = sections(config)
        self.exploiters = [Opponent("", "", "exploiter") for _ in range(EXPLOITERS)]
        self.births = [-LIFE * i // EXPLOITERS for i in range(EXPLOITERS)]
        self.patterns = [new_pattern([], generator) for _ in range(PATTERNS)]
        self.seats = np.arange(config.num_envs - self.second) % PATTERNS
        self.slots = np.zeros(SLOTS, int)

    def deal(self) -> Deal:
        """Draw networks, half of them from the given ones, and replace easy patterns with new ones."""
        weights = Pool(self.networks).weights(3.0, 0.005, initial=0.5)
        places = (self.generator.random() + np.arange(SLOTS)) / SLOTS
        self.slots = np.searchsorted(np.cumsum(weights), places * 0.999999)
        self.patterns = [one for one in self.patterns if one.games < TRIED or one.beaten < EASY]
        hard = [one for one in self.patterns if one.games >= TRIED]
        self.patterns += [new_pattern(hard, self.generator) for _ in range(PATTERNS - len(self.patterns))]
        numbers = jnp.array([one.content for one in self.patterns], jnp.float32)[self.seats]
        return Deal(stacked([self.networks[i].content for i in self.slots]), numbers)

    def count(self, over: np.ndarray, shares: np.ndarray) -> None:
        """Add to each opponent's score; arguments are, per game, ended games and sums of the learner's shares."""
        of_exploiters = np.split(np.arange(self.first), EXPLOITERS)
        of_networks = np.split(np.arange(self.first, self.second), SLOTS)
        members = self.exploiters + [self.networks[i] for i in self.slots]
        for member, places in zip(members, of_exploiters + of_networks, strict=True):
            member.add(float(over[places].sum()), float(shares[places].sum()))
        sums = [np.bincount(self.seats, kept[self.second :], PATTERNS) for kept in (over, shares)]
        for member, games, score in zip(self.patterns, *sums, strict=True):
            member.add(games, score)

    def succeed(self, number: int, main: Learner, exploiters: Learner) -> Learner:
        """Replace exploiters that succeed or are old; those that the learner hardly beats join the pool."""
        for i, member in enumerate(self.exploiters):
            age = number - self.births[i]
            if age < YOUNG or (age < LIFE and member.beaten > 0.3):
                continue
            if member.beaten < 0.52:
                actor = jax.tree.map(lambda values, i=i: jnp.copy(values[i]), exploiters.network["actor"])
                self.networks.append(Opponent(f"exploiter {number}", "", "exploiter", content=actor))
                self.networks[-1].score = self.networks[-1].games * member.beaten
            older = self.networks[self.generator.integers(len(self.networks))]
            start = main.network["actor"] if self.generator.random() < 0.5 else older.content
            new = learner_of(start, random.key(int(self.generator.integers(2**31))))
            exploiters = jax.tree.map(lambda values, one, i=i: values.at[i].set(one), exploiters, new)
            self.exploiters[i], self.births[i] = Opponent("", "", "exploiter"), number
        return exploiters

    def standing(self) -> str:
        """Return a text: the opponents from which the learner takes least."""
        parts = []
        for name in ("networks", "patterns", "exploiters"):
            hard = sorted(getattr(self, name), key=lambda one: one.beaten)
            shown = ", ".join(f"{one.name} {one.beaten:.2f}".strip() for one in hard[:4])
            parts.append(f"{len(hard)} {name}, {shown}")
        return "; ".join(parts)


def stacked(trees: list[Any]) -> Any:
    """Return trees of arrays as one tree, stacked along a new first axis."""
    return jax.tree.map(lambda *values: jnp.stack(values), *trees)


def train(config: TrainConfig, seconds: float, *, pallas: bool) -> LearnedPolicy:
    """Train, and return a policy that plays the learner's mean action."""
    began, generator, key = time.monotonic(), np.random.default_rng(config.seed), random.key(config.seed)
    pool = Opponents(config, generator)
    main = learner_of(widened(str(config.start_from), config, generator), key)
    exploiters = stacked([learner_of(main.network["actor"], random.key(1 + i)) for i in range(EXPLOITERS)])
    params, count = make_params(config.game, pallas=pallas), config.num_envs * config.rollout
    games, updates, number, done = begin(config, key, params), config.total_steps // count, 0, 0.0
    while done < 1.0:
        if number % DEAL == 0:
            deal = pool.deal()
        if number == WARM:
            main = Learner(main.network, optimizer().init(main.network))
        std = float(np.exp(config.log_std + done * (config.final_log_std - config.log_std)))
        grown = min((number - WARM + 1) / WARM, 1.0) if number >= WARM else 1.0
        schedule = (std, config.learning_rate * max(1.0 - done, 0.05) * grown, float(number >= WARM))
        key, part = random.split(key)
        main, exploiters, games, mean, *ended = update(config, main, exploiters, games, deal, params, part, schedule)
        pool.count(*map(np.asarray, ended))
        number += 1
        gone = time.monotonic() - began
        done = max(number / updates, gone / seconds if seconds else 0.0)
        if number % SNAPSHOT == 0:
            actor = jax.tree.map(jnp.copy, main.network["actor"])
            pool.networks.append(Opponent(f"at {number}", "", "snapshot", content=actor))
        exploiters = pool.succeed(number, main, exploiters)
        if number % 25 == 1 or done >= 1.0:
            print(
                f"{number * count:>11,} commands, {gone:.0f} s: value error {mean['error']:.4f}, KL {mean['kl']:.4f}, "
                f"clipped {mean['clipped']:.0%}, taken from {pool.standing()}",
                flush=True,
            )
    own, *older = lineage(load(str(config.start_from), config.game).card)
    card = {"training": config.to_dict(), "steps": number * count, "seconds": round(gone, 1)}
    card[ANCESTORS] = [own | {"name": config.start_from}, *older]
    return policy_of(config, main.network, "jax_league", **card)


def main() -> None:
    """Train, and save."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--start-from", default="warden", help="a learned policy, with whose weights the learner begins"
    )
    parser.add_argument(
        "--opponents", nargs="+", default=GIVEN, help="learned policies that are in the pool from the start"
    )
    parser.add_argument("--commands", type=int, default=10**9, help="commands of the learner to stop after")
    parser.add_argument("--seconds", type=float, default=0.0, help="seconds to stop after; 0: no limit")
    parser.add_argument("--games", type=int, default=CONFIG.num_envs, help="games at once")
    parser.add_argument("--pallas", action="store_true", help="play in a kernel for NVIDIA's GPUs")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/jax_league"))
    options = parser.parse_args()
    config = CONFIG.replace(
        start_from=options.start_from,
        opponents=tuple(options.opponents),
        total_steps=options.commands,
        num_envs=options.games,
        seed=options.seed,
    )
    train(config, options.seconds, pallas=options.pallas).write(options.out)
    print(f"policy: {options.out}")


if __name__ == "__main__":
    main()
