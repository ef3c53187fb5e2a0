"""Digests of what players are: of learned ones their weights and card, of scripts their source."""

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

from swarm_pz.policies.scripted import ScriptedPolicy, Tactic, View
from swarm_pz.policy import Player, registered

_OWN = ("swarm_pz.policies.", "swarm_pz.spaces.densities")
"""Modules whose code counts as a script's own; what is below them belongs to the version."""


def identity_of(name: str, player: Player) -> str:
    """Return the digest of a learned player or a script; of others the package and its version."""
    if (told := getattr(player, "digest", None)) is not None:
        return str(told)
    point = registered().get(name.split(":", 1)[0])
    if point is None:
        return type(player).__name__
    made = point.load()
    if isinstance(made, Tactic):
        return source_digest(made)
    origin = point.dist.name if point.dist is not None else "swarm-pz"
    return f"{origin} {importlib.metadata.version(origin)}: {name}"


def source_digest(tactic: Tactic) -> str:
    """Return a digest of a script's code and of all own code that it calls; not of its words and its form."""
    seen: dict[str, Any] = {}
    for part in (tactic.play, View, ScriptedPolicy):
        _gather(part, seen)
    told = [f"{name} {_canonical(value)}" for name, value in sorted(seen.items())]
    told.append(repr(tactic.observation.to_dict()))
    return hashlib.sha256("\n".join(told).encode()).hexdigest()[:32]


def _gather(part: Any, seen: dict[str, Any]) -> None:
    """Add the tree of a function or class, and of what it names, under where they stand."""
    key = f"{part.__module__}.{part.__qualname__}"
    if key in seen:
        return
    tree = ast.parse(textwrap.dedent(inspect.getsource(part))).body[0]
    seen[key] = tree
    space = vars(sys.modules[part.__module__])
    for value in _named(tree, space):
        one = value.play if isinstance(value, Tactic) else value
        if callable(one) and str(getattr(one, "__module__", "")).startswith(_OWN) and hasattr(one, "__qualname__"):
            _gather(one, seen)
    for name in _words(tree):
        if name.isupper() and isinstance(value := space.get(name), (int, float, str, tuple)):
            seen[f"{part.__module__}.{name}"] = repr(value)


def _words(tree: ast.AST) -> Iterator[str]:
    yield from sorted({node.id for node in ast.walk(tree) if isinstance(node, ast.Name)})


def _named(tree: ast.AST, space: dict[str, Any]) -> Iterator[Any]:
    """Yield what the names in some code stand for, those in modules that it names, too."""
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
