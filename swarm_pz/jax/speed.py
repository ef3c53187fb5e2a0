"""Speed of games in JAX on its default device."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import jax

from swarm_pz.config import AGENTS, GameConfig
from swarm_pz.jax.game import reset, step
from swarm_pz.jax.params import State, make_params

_COMMANDS = 8


def make_steps() -> dict[str, Any]:
    """Return the makers of steps by name, with the Pallas kernel if there is a GPU."""
    plain = {"jax": make_jax_step}
    return plain if jax.default_backend() == "cpu" else plain | {"jax, pallas": partial(make_jax_step, pallas=True)}


def make_jax_step(config: GameConfig, games: int, threads: int, *, pallas: bool = False) -> Callable[[], object]:
    """Return a step of many games, with the observations of both sides; as `swarm_pz.bench.MakeStep` does."""
    del threads  # XLA chooses its threads itself
    params = make_params(config, pallas=pallas)
    key, drawn = jax.random.split(jax.random.key(0))
    commands = jax.random.uniform(drawn, (_COMMANDS, 2, games, config.command_cells, config.command_cells))
    keys = jax.random.split(key, (_COMMANDS, games))
    state = jax.jit(lambda keys: jax.vmap(reset, (0, None))(keys, params)[1])(keys[0])
    taken = 0

    @partial(jax.jit, donate_argnums=1)
    def advance(keys: Any, state: State, pair: Any) -> Any:
        return jax.vmap(step, (0, 0, 0, None))(keys, state, dict(zip(AGENTS, pair, strict=True)), params)

    def take() -> None:
        nonlocal state, taken
        _, state, *_ = jax.block_until_ready(advance(keys[taken % _COMMANDS], state, commands[taken % _COMMANDS]))
        taken += 1

    return take


def device() -> str:
    """Return the name of the device that JAX computes on."""
    first = jax.devices()[0]
    return "the processor: JAX found no accelerator" if first.platform == "cpu" else str(first.device_kind)
