"""The network of learned tactics, `swarm_pz.policies.network.Actor`, as functions of its weights.

Weights are a dict with PyTorch's names, so that policies of the zoo play here, and policies trained here play
everywhere.
"""

from __future__ import annotations

import jax
import numpy as np
from jax import numpy as jnp

from swarm_pz.config import GameConfig
from swarm_pz.jax.params import Array
from swarm_pz.policies.symmetry import ORIENTATIONS, kernel_places
from swarm_pz.simulator.commands import interpolation_matrix
from swarm_pz.spaces.actions import LOG_DENSITY_RANGE

Weights = dict[str, Array]
_CELLS = GameConfig().command_cells


def init_weights(key: Array, channels: int, block: int, cells: int, width: int = 32) -> Weights:
    """Draw weights of a network whose first densities are close to uniform.

    It sees images (channels, block * cells, block * cells), and its actions are (cells, cells). `width` is the number
    of hidden channels, a multiple of eight.
    """
    features = width // ORIENTATIONS
    shapes = {
        "near.0": (features, channels + 1, 1, block, block),
        "near.2": (features, features, ORIENTATIONS, 3, 3),
        "around": (features, features, ORIENTATIONS, 3, 3),
        "whole.0": (features, features, ORIENTATIONS, cells, cells),
        "whole.2": (features, features, ORIENTATIONS, 1, 1),
    }
    weights: Weights = {}
    *parts, last = jax.random.split(key, len(shapes) + 1)
    for part, (name, shape) in zip(parts, shapes.items(), strict=True):
        scale = (2.0 / np.prod(shape[1:])) ** 0.5
        weights[f"trunk.{name}.weight"] = scale * jax.random.normal(part, shape)
        weights[f"trunk.{name}.bias"] = jnp.zeros(shape[0])
    head = jax.random.normal(last, (1, features, 1, 1))
    weights["head.weight"] = 0.01 * head / jnp.linalg.norm(head)
    weights["head.bias"] = jnp.zeros(1)
    return weights


def features_of(weights: Weights, images: Array) -> Array:
    """Turn observations (n, C, G, G) in [0, 1] into features (n, width, a, a)."""
    grid = images.shape[-1]
    axis = jnp.abs(jnp.linspace(-1.0, 1.0, grid))
    edge = jnp.broadcast_to(jnp.maximum(axis[:, None], axis)[..., None], (len(images), grid, grid, 1))

    def convolve(name: str, inputs: Array, *, is_block: bool = False) -> Array:
        """Convolve (channels last) as a matrix product: in a loop on a CPU, XLA's convolutions are ten times slower."""
        weight, bias = weights[f"trunk.{name}.weight"], weights[f"trunk.{name}.bias"]
        kernel = weight.reshape(-1)[kernel_places(weight.shape).transpose(2, 3, 1, 0)]
        count, rows, columns, channels = inputs.shape
        size = len(kernel)
        if is_block:
            blocks = inputs.reshape(count, rows // size, size, columns // size, size, channels)
            parts = blocks.swapaxes(2, 3).reshape(count, rows // size, columns // size, -1)
        else:
            framed = jnp.pad(inputs, ((0, 0), (size // 2,) * 2, (size // 2,) * 2, (0, 0)))
            shifts = [framed[:, y : y + rows, x : x + columns] for y in range(size) for x in range(size)]
            parts = jnp.concatenate(shifts, axis=-1)
        return parts @ kernel.reshape(-1, kernel.shape[-1]) + jnp.tile(bias, ORIENTATIONS)

    inputs = jnp.concatenate([jnp.moveaxis(images, 1, -1), edge], axis=-1)
    near = jax.nn.relu(convolve("near.2", jax.nn.relu(convolve("near.0", inputs, is_block=True))))
    whole = convolve("whole.2", jax.nn.relu(convolve("whole.0", near, is_block=True)), is_block=True)
    return jnp.moveaxis(jax.nn.relu(convolve("around", near) + whole), -1, 1)


def decide(weights: Weights, features: Array) -> Array:
    """Turn features (n, width, a, a) into mean actions (n, a, a)."""
    head = jnp.tile(weights["head.weight"].reshape(-1), ORIENTATIONS) / ORIENTATIONS  # averages over orientations
    return jnp.einsum("nfyx,f->nyx", features, head) + weights["head.bias"]


def density_of(actions: Array) -> Array:
    """Turn actions (..., a, a), logarithms of densities, into densities (..., 10, 10) whose largest value is 1."""
    fine = jnp.asarray(interpolation_matrix(_CELLS, actions.shape[-1]), jnp.float32)
    values = fine @ jnp.clip(actions, -1.0, 1.0) @ fine.T
    return jnp.exp(LOG_DENSITY_RANGE * (values - values.max(axis=(-2, -1), keepdims=True)))
