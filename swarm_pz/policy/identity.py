"""Digests of players: of their weights, their source code or their files."""

from __future__ import annotations

import ast
import hashlib
import importlib.metadata
import inspect
import sys
import textwrap
from collections.abc import Iterator
from types import ModuleType
from typing import Any

from swarm_pz.policy.names import module_of, registered
from swarm_pz.policy.program import Program
from swarm_pz.policy.protocol import Player, PrivilegedPolicy

_OWN = ("swarm_pz.policies.", "swarm_pz.spaces.densities")
"""Modules whose code counts as a script's own; the version covers the modules below them."""


def sort_of(player: Player) -> str:
    """Return the sort of a player: "planned" (it reads the simulator), "learned", "scripted" or "program"."""
    if isinstance(player, Program):
        return "program"
    if isinstance(player, PrivilegedPolicy):
        return "planned"
    return "scripted" if getattr(player, "digest", None) is None else "learned"


def digest_of(name: str, player: Player) -> str | None:
    """Return a digest of a learned player, a program, a script, or a tactic in a file; None for others."""
    if (digest := getattr(player, "digest", None)) is not None:
        return str(digest)
    if (point := registered().get(name.split(":", 1)[0])) is not None:
        made = point.load()
        return source_digest(made) if _is_tactic(made) else None
    file, _, tactic = name.rpartition(":")
    if not file.endswith(".py"):
        return None
    return hashlib.sha256(f"{module_of(file).__digest__} {tactic}".encode()).hexdigest()[:32]


def identity_of(name: str, player: Player) -> str:
    """Return a player's digest, or else its package with the version."""
    if (digest := digest_of(name, player)) is not None:
        return digest
    point = registered().get(name.split(":", 1)[0])
    if point is None:
        return type(player).__name__
    origin = point.dist.name if point.dist is not None else "swarm-pz"
    return f"{origin} {importlib.metadata.version(origin)}: {name}"


def _is_tactic(made: Any) -> bool:
    """Return True for a `swarm_pz.policies.scripted.Tactic`, which this layer cannot import."""
    return callable(getattr(made, "play", None)) and hasattr(made, "observation")


def source_digest(tactic: Any) -> str:
    """Return a digest of a tactic's code and of all own code that it calls, without comments and layout."""
    scripted = sys.modules[type(tactic).__module__]
    gathered: dict[str, Any] = {}
    for part in (tactic.play, scripted.View, scripted.ScriptedPolicy):
        _gather(part, gathered)
    parts = [f"{name} {_canonical(value)}" for name, value in sorted(gathered.items())]
    parts.append(repr(tactic.observation.to_dict()))
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


def _gather(part: Any, gathered: dict[str, Any]) -> None:
    """Add the syntax trees of a function or class and of all that it names, by module and name."""
    key = f"{part.__module__}.{part.__qualname__}"
    if key in gathered:
        return
    tree = ast.parse(textwrap.dedent(inspect.getsource(part))).body[0]
    gathered[key] = tree
    space = vars(sys.modules[part.__module__])
    for value in _named(tree, space):
        one = value.play if _is_tactic(value) else value
        if callable(one) and str(getattr(one, "__module__", "")).startswith(_OWN) and hasattr(one, "__qualname__"):
            _gather(one, gathered)
    for name in _words(tree):
        value = space.get(name)
        if isinstance(value, tuple) and any(map(_is_tactic, value)):
            for one in value:
                _gather(one.play, gathered)
        elif name.isupper() and isinstance(value, (int, float, str, tuple)):
            gathered[f"{part.__module__}.{name}"] = repr(value)


def _words(tree: ast.AST) -> Iterator[str]:
    yield from sorted({node.id for node in ast.walk(tree) if isinstance(node, ast.Name)})


def _named(tree: ast.AST, space: dict[str, Any]) -> Iterator[Any]:
    """Yield the values of names in some code, also of attributes of modules."""
    for name in _words(tree):
        if name in space:
            yield space[name]
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            module = space.get(node.value.id)
            if isinstance(module, ModuleType) and module.__name__.startswith(_OWN):
                yield getattr(module, node.attr, None)


def _canonical(tree: Any) -> str:
    """Return code as text that is the same in every version of Python, without docstrings."""
    if not isinstance(tree, ast.AST):
        return "[" + ",".join(map(_canonical, tree)) + "]" if isinstance(tree, list) else repr(tree)
    fields = {
        name: value
        for name, value in ast.iter_fields(tree)
        if value not in (None, []) and name not in ("ctx", "kind", "type_comment", "annotation", "returns")
    }
    if isinstance(tree, (ast.FunctionDef, ast.ClassDef)):
        fields.pop("decorator_list", None)
        if ast.get_docstring(tree, clean=False) is not None:
            fields["body"] = fields["body"][1:]
    inside = ",".join(f"{name}={_canonical(value)}" for name, value in sorted(fields.items()))
    return f"{type(tree).__name__}({inside})"
