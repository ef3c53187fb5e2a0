"""IPPO in the shape of JaxMARL's baselines, in self-play: a small network chooses one of 57 named densities a second.

python examples/jax_ippo.py                  # each side's critic sees what the side sees
python examples/jax_ippo.py --world-state    # MAPPO: each critic sees both sides' images
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from typing import Any, NamedTuple

import jax
import numpy as np
import optax
from jax import lax, random
from jax import numpy as jnp

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.jax import make_params
from swarm_pz.jax.environments import TwoSides
from swarm_pz.jax.players import load

GAME = GameConfig(observation=ObservationConfig(grid=10))
GAMES, STEPS, EPOCHS, BATCHES = 64, 32, 4, 4
OPPONENTS = ("noise", "uniform")
RATE, GAMMA, LAMBDA, CLIP, ENTROPY, VALUE, LARGEST_GRADIENT = 1e-3, 0.98, 0.95, 0.2, 0.01, 0.5, 0.5


class Step(NamedTuple):
    """A step of all games: a row for each agent of each game, agent by agent."""

    seen: jax.Array
    world: jax.Array
    actions: jax.Array
    log_probs: jax.Array
    values: jax.Array
    rewards: jax.Array
    dones: jax.Array


def init_layers(key: jax.Array, *sizes: int, last: float) -> list[tuple[jax.Array, jax.Array]]:
    """Draw orthogonal layers, the last one with the scale `last`."""
    scales = [np.sqrt(2)] * (len(sizes) - 2) + [last]
    keys = random.split(key, len(scales))
    shapes = pairwise(sizes)
    return [
        (jax.nn.initializers.orthogonal(scale)(key, shape), jnp.zeros(shape[1]))
        for key, scale, shape in zip(keys, scales, shapes, strict=True)
    ]


def apply(layers: list[tuple[jax.Array, jax.Array]], values: jax.Array) -> jax.Array:
    """Return the outputs (n, last) of a network."""
    for weights, bias in layers[:-1]:
        values = jnp.tanh(values @ weights + bias)
    return values @ layers[-1][0] + layers[-1][1]


def make_train(env: TwoSides, updates: int, *, world_state: bool) -> Any:
    """Return a function that trains from a key; it returns the network, and each update's captures and wins."""
    rows = env.num_agents * GAMES
    rate = optax.linear_schedule(RATE, 0.0, updates * EPOCHS * BATCHES)
    optimizer = optax.chain(optax.clip_by_global_norm(LARGEST_GRADIENT), optax.adam(rate, eps=1e-5))
    size = env.observation_space(env.agents[0]).shape[0]
    count = env.action_space(env.agents[0]).n

    def batchify(values: dict[str, jax.Array]) -> jax.Array:
        return jnp.stack([values[agent] for agent in env.agents]).reshape(rows, -1)

    def inputs(obs: dict[str, jax.Array]) -> tuple[jax.Array, jax.Array]:
        """Return the observations of actors and of critics, (rows, ...) each."""
        mine = batchify(obs)
        return mine, obs["world_state"].swapaxes(0, 1).reshape(rows, -1) if world_state else mine

    def loss_of(network: dict[str, Any], steps: Step, gains: jax.Array, targets: jax.Array) -> jax.Array:
        log_probs = jax.nn.log_softmax(apply(network["actor"], steps.seen))
        ratio = jnp.exp(jnp.take_along_axis(log_probs, steps.actions[:, None], 1)[:, 0] - steps.log_probs)
        scaled = (gains - gains.mean()) / (gains.std() + 1e-8)
        gain = jnp.minimum(ratio * scaled, jnp.clip(ratio, 1 - CLIP, 1 + CLIP) * scaled).mean()
        values = apply(network["critic"], steps.world)[:, 0]
        kept = steps.values + jnp.clip(values - steps.values, -CLIP, CLIP)
        error = 0.5 * jnp.maximum(jnp.square(values - targets), jnp.square(kept - targets)).mean()
        entropy = -(jnp.exp(log_probs) * log_probs).sum(axis=1).mean()
        return VALUE * error - gain - ENTROPY * entropy

    def update(carried: tuple[Any, ...], key: jax.Array) -> tuple[tuple[Any, ...], dict[str, jax.Array]]:
        network, state, games, obs = carried
        to_games, to_epochs = random.split(key)

        def play(carried, key):
            games, obs = carried
            to_actions, to_steps = random.split(key)
            mine, world = inputs(obs)
            log_probs = jax.nn.log_softmax(apply(network["actor"], mine))
            actions = random.categorical(to_actions, log_probs)
            chosen = jnp.take_along_axis(log_probs, actions[:, None], 1)[:, 0]
            by_agent = dict(zip(env.agents, actions.reshape(env.num_agents, GAMES), strict=True))
            obs, games, rewards, dones, infos = jax.vmap(env.step)(random.split(to_steps, GAMES), games, by_agent)
            infos = jax.tree.map(lambda info: info.reshape(rows), infos)
            values = apply(network["critic"], world)[:, 0]
            step = Step(mine, world, actions, chosen, values, batchify(rewards)[:, 0], batchify(dones)[:, 0])
            return (games, obs), (step, {"captures": infos["captured"].mean(), "wins": (infos["outcome"] > 0).sum()})

        (games, obs), (steps, metrics) = lax.scan(play, (games, obs), random.split(to_games, STEPS))

        def before(carried, step):
            running, following = carried
            discount = GAMMA * (1 - step.dones)
            running = step.rewards + discount * (following + LAMBDA * running) - step.values
            return (running, step.values), running

        last = apply(network["critic"], inputs(obs)[1])[:, 0]
        gains = lax.scan(before, (jnp.zeros(rows), last), steps, reverse=True)[1]
        data = jax.tree.map(
            lambda kept: kept.reshape(STEPS * rows, *kept.shape[2:]), (steps, gains, gains + steps.values)
        )

        def improve(carried, rows):
            network, state = carried
            gradients = jax.grad(loss_of)(network, *jax.tree.map(lambda kept: kept[rows], data))
            changes, state = optimizer.update(gradients, state)
            return (optax.apply_updates(network, changes), state), None

        orders = jax.vmap(random.permutation, (0, None))(random.split(to_epochs, EPOCHS), STEPS * rows)
        (network, state), _ = lax.scan(improve, (network, state), orders.reshape(EPOCHS * BATCHES, -1))
        return (network, state, games, obs), jax.tree.map(jnp.sum, metrics)

    def train(key: jax.Array) -> tuple[dict[str, Any], dict[str, jax.Array]]:
        to_actor, to_critic, to_games, key = random.split(key, 4)
        network = {
            "actor": init_layers(to_actor, size, 64, 64, count, last=0.01),
            "critic": init_layers(to_critic, env.world_state_size() if world_state else size, 64, 64, 1, last=1.0),
        }
        obs, games = jax.vmap(env.reset)(random.split(to_games, GAMES))
        carried = network, optimizer.init(network), games, obs
        (network, *_), metrics = lax.scan(update, carried, random.split(key, updates))
        return network, metrics

    return jax.jit(train)


def outcomes(network: dict[str, Any], env: TwoSides, key: jax.Array, games: int) -> jax.Array:
    """Return the outcomes (games,) for red, which plays its likeliest actions: 1 won, 0 drawn, -1 lost."""
    seconds = -(-int(env.params.limit_ticks) // int(env.params.step_ticks))

    def play(key):
        def step(carried, key):
            state, obs = carried
            actions = {"red_0": apply(network["actor"], obs["red_0"]).argmax()}
            obs, state, _, _, infos = env.step_env(key, state, actions)
            return (state, obs), infos["outcome"][0]  # 0 once a game has ended

        obs, state = env.reset(key)
        return lax.scan(step, (state, obs), random.split(key, seconds))[1].sum()

    return jax.jit(jax.vmap(play))(random.split(key, games))


def main() -> None:
    """Train, and play games."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commands", type=int, default=327_680, help="commands to learn from, of both sides")
    parser.add_argument("--games", type=int, default=100, help="games against each opponent")
    parser.add_argument("--world-state", action="store_true", help="critics see both sides' images")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()

    params, words = make_params(GAME), {"action": "discrete", "observation": "vector"}
    env = TwoSides(params, **words)
    updates = max(options.commands // (env.num_agents * GAMES * STEPS), 1)
    network, metrics = make_train(env, updates, world_state=options.world_state)(random.key(options.seed))
    print(f"{updates} updates: {metrics['wins'].sum()} games won in self-play")
    for opponent in OPPONENTS:
        results = outcomes(network, TwoSides(params, **words, opponent=load(opponent)), random.key(1), options.games)
        print(f"against {opponent}: {(results > 0).sum()} won, {(results < 0).sum()} lost of {options.games}")


if __name__ == "__main__":
    main()
