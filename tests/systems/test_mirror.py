"""Each control system beside its slow reference, whoever is heard, in random states."""

from __future__ import annotations

import importlib

import pytest

from swarm_pz.config.registry import registered


@pytest.mark.parametrize("name", sorted(registered()))
def test_it_is_its_slow_mirror(name):
    assert importlib.import_module(f"tests.systems.reference_{name}").compare(60, seed=0) < 1e-4
