"""PPO in self-play in one file, like PureJaxRL: games, network and learning are one function under `jit`.

python examples/jax_ppo.py --commands 393216

The output folder is a player: swarm-pz evaluate runs/jax_ppo --opponent ring
"""

from __future__ import annotations

import argparse
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
import optax
from jax import lax, random
from jax import numpy as jnp

from swarm_pz import GameConfig, ObservationConfig
from swarm_pz.config import AGENTS
from swarm_pz.evaluation import play_match
from swarm_pz.evaluation.provenance import provenance
from swarm_pz.jax import Params, make_params, reset, step
from swarm_pz.jax.network import decide, density_of, features_of, init_weights
from swarm_pz.policies.learned import FORMAT, LearnedPolicy
from swarm_pz.policies.symmetry import ORIENTATIONS, kernel_places
from swarm_pz.training.config import TrainConfig

RECIPE = TrainConfig(
    game=GameConfig(observation=ObservationConfig(grid=10)),
    num_envs=64,  # games; each gives two rows a step, one for each side
    rollout=64,
    batch_size=512,
    epochs=3,
    learning_rate=8e-4,  # at the start; it falls linearly to a twentieth
    gamma=0.98,
    gae_lambda=0.95,
    clip_range=0.2,
    log_std=-0.7,  # logarithm of the exploration's standard deviation at the start, and at the end
    final_log_std=-2.0,
)
CRITIC_FEATURES, VALUE_WEIGHT, LARGEST_GRADIENT = 16, 0.5, 0.5


class Learner(NamedTuple):
    """All that an update changes: the network, its optimizer's state, the games, and what both sides see of them."""

    network: dict[str, Any]
    optimizer: Any
    states: Any
    seen: dict[str, jax.Array]
    key: jax.Array
    updates: jax.Array


class Step(NamedTuple):
    """A step of all games: a row for each side of each game, red's first."""

    seen: jax.Array
    actions: jax.Array
    log_probs: jax.Array
    values: jax.Array
    rewards: jax.Array
    over: jax.Array


def rows_of(config: TrainConfig) -> int:
    """Return the number of commands of both sides between two updates."""
    return 2 * config.num_envs * config.rollout


def both(values: dict[str, jax.Array]) -> jax.Array:
    """Return the rows of red, then those of blue."""
    return jnp.concatenate([values[agent] for agent in AGENTS])


def answer(network: dict[str, Any], images: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Turn images (n, 9, 10, 10) into mean actions (n, 5, 5) and values (n,)."""
    features, critic = features_of(network["actor"], images / np.float32(255)), network["critic"]
    kernel = critic["kernel"].reshape(-1)[kernel_places(critic["kernel"].shape)]
    summary = features.reshape(len(images), -1) @ kernel.reshape(len(kernel), -1).T
    summary = jax.nn.relu(summary + jnp.tile(critic["bias"], ORIENTATIONS))
    summary = summary.reshape(-1, ORIENTATIONS, CRITIC_FEATURES).mean(axis=1)  # the same for a turned board
    return decide(network["actor"], features), summary @ critic["worth"]


def log_prob(actions: jax.Array, means: jax.Array, std: jax.Array) -> jax.Array:
    """Return logarithms (n,) of Gaussian densities, without the terms that cancel in ratios."""
    return -0.5 * jnp.square((actions - means) / std).sum(axis=(1, 2))


def optimizer_of(config: TrainConfig) -> optax.GradientTransformation:
    """Return the optimizer."""
    changes = config.epochs * config.total_steps // min(config.batch_size, rows_of(config))
    rate = optax.linear_schedule(config.learning_rate, config.learning_rate / 20, changes)
    return optax.chain(optax.clip_by_global_norm(LARGEST_GRADIENT), optax.adam(rate, eps=1e-5))


def init_critic(to_kernel: jax.Array, to_worth: jax.Array, features: int, cells: int) -> dict[str, jax.Array]:
    """Draw the weights of a critic of features (features, orientations, cells, cells)."""
    shape = (CRITIC_FEATURES, features, ORIENTATIONS, cells, cells)
    worth = random.normal(to_worth, (CRITIC_FEATURES,))
    return {
        "kernel": random.normal(to_kernel, shape) * np.sqrt(2 / np.prod(shape[1:])),
        "bias": jnp.zeros(CRITIC_FEATURES),
        "worth": worth / jnp.linalg.norm(worth),
    }


@partial(jax.jit, static_argnames="config")
def begin(config: TrainConfig, key: jax.Array, params: Params) -> Learner:
    """Return a learner that has learned nothing, and games at their starts."""
    to_actor, to_kernel, to_worth, to_games, key = random.split(key, 5)
    view, cells = config.game.observations[0], config.action_cells
    network = {
        "actor": init_weights(to_actor, len(view.channels), view.grid // cells, cells, config.width),
        "critic": init_critic(to_kernel, to_worth, config.width // ORIENTATIONS, cells),
    }
    images, states = jax.vmap(reset, (0, None))(random.split(to_games, config.num_envs), params)
    return Learner(network, optimizer_of(config).init(network), states, images, key, jnp.int32(0))


def advantages(config: TrainConfig, steps: Step, last: jax.Array) -> jax.Array:
    """Return generalised advantage estimates (steps, rows).

    A draw on time ends a game like a win: the limit is a rule, both sides see the time left, and nothing follows.
    """

    def before(carried, step):
        running, following = carried
        discount = config.gamma * ~step.over
        running = step.rewards + discount * (following + config.gae_lambda * running) - step.values
        return (running, step.values), running

    return lax.scan(before, (jnp.zeros_like(last), last), steps, reverse=True)[1]


def loss_of(network, steps: Step, gains: jax.Array, std: jax.Array, clip: float):
    """Return the loss, from the clipped objective and the critic's error, and figures of both."""
    means, values = answer(network, steps.seen)
    log_ratio = log_prob(steps.actions, means, std) - steps.log_probs
    ratio, error = jnp.exp(log_ratio), jnp.square(values - steps.values - gains).mean()
    scaled = (gains - gains.mean()) / (gains.std() + 1e-8)
    gain = jnp.minimum(scaled * ratio, scaled * jnp.clip(ratio, 1 - clip, 1 + clip)).mean()
    metrics = {"error": error, "kl": (ratio - 1 - log_ratio).mean(), "clipped": (jnp.abs(ratio - 1) > clip).mean()}
    return VALUE_WEIGHT * error - gain, metrics


def learn(config: TrainConfig, learned: tuple[Any, Any], steps: Step, last: jax.Array, key, std, change, batch: int):
    """Improve a network, given with its optimizer's state, by its rows (T, n, ...); return both, and mean figures.

    `last` (n,) are values after the rows. `change` turns gradients, network and state into the next network and state,
    after each `batch` rows.
    """
    count = steps.rewards.size
    data = jax.tree.map(lambda kept: kept.reshape(count, *kept.shape[2:]), (steps, advantages(config, steps, last)))

    def improve(learned, rows):
        part, gains = jax.tree.map(lambda kept: kept[rows], data)
        gradients, metrics = jax.grad(loss_of, has_aux=True)(learned[0], part, gains, std, config.clip_range)
        return change(gradients, *learned), metrics

    orders = jax.vmap(random.permutation, (0, None))(random.split(key, config.epochs), count)
    learned, metrics = lax.scan(improve, learned, orders.reshape(-1, batch))
    return learned, jax.tree.map(jnp.mean, metrics)


@partial(jax.jit, static_argnames="config", donate_argnames="learner")
def update(config: TrainConfig, learner: Learner, params: Params) -> tuple[Learner, dict[str, jax.Array]]:
    """Play all games for some steps, and learn from what both sides did."""
    count, optimizer = rows_of(config), optimizer_of(config)
    done = learner.updates * count / config.total_steps
    std = jnp.exp(config.log_std + done * (config.final_log_std - config.log_std))
    to_games, to_epochs, key = random.split(learner.key, 3)

    def play(carried, key):
        states, images = carried
        to_actions, to_starts = random.split(key)
        rows = both(images)
        means, values = answer(learner.network, rows)
        actions = means + std * random.normal(to_actions, means.shape)
        commands = dict(zip(AGENTS, jnp.split(density_of(actions), 2), strict=True))  # clips actions to [-1, 1]
        starts = random.split(to_starts, config.num_envs)
        images, states, rewards, dones, infos = jax.vmap(step, (0, 0, 0, None))(starts, states, commands, params)
        metrics = {"captures": infos["captured"], "ends": dones["__all__"], "wins": infos["outcome"] > 0}
        kept = Step(rows, actions, log_prob(actions, means, std), values, both(rewards), both(dones))
        return (states, images), (kept, jax.tree.map(jnp.sum, metrics))

    games, (steps, played) = lax.scan(play, (learner.states, learner.seen), random.split(to_games, config.rollout))
    _, last = answer(learner.network, both(games[1]))

    def change(gradients, network, state):
        changes, state = optimizer.update(gradients, state)
        return optax.apply_updates(network, changes), state

    learned, batch = (learner.network, learner.optimizer), min(config.batch_size, count)
    learned, metrics = learn(config, learned, steps, last, to_epochs, std, change, batch)
    return Learner(*learned, *games, key, learner.updates + 1), jax.tree.map(jnp.sum, played) | metrics


def policy_of(config: TrainConfig, network: dict[str, Any], name: str, **card: Any) -> LearnedPolicy:
    """Return the policy that plays a network's mean action; `card` says how it was trained."""
    view, game = config.game.observations[0], config.game
    card |= {"format": FORMAT, "channels": list(view.channels), "grid": view.grid, "action_cells": config.action_cells}
    card |= {"width": config.width, "config_hash": game.hash, **provenance(game, " ".join(["python", *sys.argv]))}
    return LearnedPolicy(card, jax.tree.map(np.array, network["actor"]), game, name)


def train(config: TrainConfig) -> LearnedPolicy:
    """Train, and return a policy that plays the learned mean action."""
    began, params, count = time.monotonic(), make_params(config.game), rows_of(config)
    learner, updates = begin(config, random.key(config.seed), params), config.total_steps // count
    for number in range(1, updates + 1):
        learner, metrics = update(config, learner, params)
        if number % 5 == 1 or number == updates:
            print(
                f"{number * count:>9,} commands, {time.monotonic() - began:.0f} s: {metrics['captures'] / count:.3f} "
                f"captures a command, {metrics['wins']} of {metrics['ends']} games won, "
                f"value error {metrics['error']:.4f}, KL {metrics['kl']:.4f}, clipped {metrics['clipped']:.1%}",
                flush=True,
            )
    training, seconds = config.to_dict(), round(time.monotonic() - began, 1)
    training.pop("opponents")  # there were none but itself
    return policy_of(config, learner.network, "jax_ppo", training=training, steps=config.total_steps, seconds=seconds)


def main() -> None:
    """Train, save, and play matches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commands", type=int, default=393_216, help="commands to learn from, of both sides")
    parser.add_argument("--games", type=int, default=100, help="games against each opponent, even")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/jax_ppo"))
    options = parser.parse_args()

    commands = max(options.commands // rows_of(RECIPE), 1) * rows_of(RECIPE)
    train(RECIPE.replace(total_steps=commands, seed=options.seed)).write(options.out)
    print(f"commands seen: {commands}")

    for opponent in ("noise", "uniform"):
        match = play_match(str(options.out), opponent, games=options.games, seed=1, config=RECIPE.game, threads=2)
        match.write(options.out / f"{opponent}.json")
        low, high = match.share_interval()
        print(f"against {opponent}: {match.standing()}, share {match.share():.2f} [{low:.2f}, {high:.2f}]")


if __name__ == "__main__":
    main()
