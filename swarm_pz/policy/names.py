"""Policies by name.

Names are entry points of the group `swarm_pz.policies`: callables from a `GameConfig` to a policy. A folder is read
by the entry point of `swarm_pz.policy_folders` that has the name of a file in it, called with folder and `GameConfig`.
FILE.py:NAME is a tactic in a Python file, and exec:PROGRAM a program. These run code, so `load` accepts only those
named on the command line: see `allow_files`.
"""

from __future__ import annotations

import copy
import functools
import hashlib
import importlib.metadata
import importlib.util
import modulefinder
import os
import re
import sys
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from swarm_pz.config import GameConfig
from swarm_pz.config.installed import FAULTS, entry_points, origin, registered_in
from swarm_pz.config.system import ControlSystem, serves_densities
from swarm_pz.errors import CheckpointError, KindError, PolicyError, SwarmError, nearest
from swarm_pz.policy.model_policy import Model, ModelPolicy
from swarm_pz.policy.program import Program
from swarm_pz.policy.protocol import ANY, Player, Policy, PrivilegedPolicy, answers_of

GROUP, FOLDERS = "swarm_pz.policies", "swarm_pz.policy_folders"
_ALLOWED = "SWARM_PZ_FILES"
"""Environment variable with the allowed names, one a line; child processes inherit it."""
_EXEC = "exec:"
_FACTORY = "a tactic (its function stands below @tactic), or a callable from a GameConfig to a policy"
_IN_FILE = re.compile(r"(?:--[\w.-]+=)?(.+\.py:\w+|exec:.*)")


def allow_files(words: Sequence[str]) -> None:
    """Allow, from now on, only the files and programs on a command line."""
    os.environ[_ALLOWED] = "\n".join(match[1] for word in words if (match := _IN_FILE.fullmatch(word)))


@dataclass(frozen=True)
class _InFile:
    """An entry point for a name FILE.py:NAME or exec:PROGRAM."""

    value: str

    def load(self) -> Any:
        """Return the factory of that name, or one that starts the program."""
        if self.value not in os.environ.get(_ALLOWED, "").split("\n"):
            raise PolicyError(
                f"{self.value!r} runs code of a file or a program: the command line alone may name one; in Python, "
                "import it, or make a swarm_pz.policy.Program"
            )
        if self.value.startswith(_EXEC):
            return functools.partial(Program, line=self.value.removeprefix(_EXEC))
        file, name = self.value.rsplit(":", 1)
        module = module_of(file)
        if not hasattr(module, name):
            own = [key for key, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__]
            raise PolicyError(f"{file} has no {name!r}; {nearest(name, own)}")
        factory = getattr(module, name)
        if not callable(factory):
            raise PolicyError(f"{name!r} of {file} must be {_FACTORY}, got {factory!r}")
        return factory


def module_of(file: str) -> Any:
    """Return the module of a file, run once per process; `__digest__` covers it and its imports from its folder."""
    path = Path(file).resolve()
    if str(path) in sys.modules:
        return sys.modules[str(path)]
    if not path.is_file():
        raise PolicyError(f"there is no file {file!r}")
    spec = importlib.util.spec_from_file_location(str(path), path)
    if spec is None or spec.loader is None:
        raise PolicyError(f"{file} is no file of Python")
    module = sys.modules[str(path)] = importlib.util.module_from_spec(spec)
    sys.path.append(str(path.parent))  # for imports from its folder
    try:
        spec.loader.exec_module(module)
        module.__dict__["__digest__"] = _source_digest(path)
    except FAULTS as error:
        del sys.modules[str(path)]
        lines = [entry.lineno for entry in traceback.extract_tb(error.__traceback__) if entry.filename == str(path)]
        where = f", line {lines[-1]}," if lines else ""
        raise PolicyError(f"{file}{where} cannot be imported: {error!r}") from error
    finally:
        sys.path.remove(str(path.parent))
    return module


def _source_digest(path: Path) -> str:
    """Return a digest of a Python file and of its imports from its folder."""
    finder = modulefinder.ModuleFinder([str(path.parent)], excludes=["swarm_pz"])
    finder.run_script(str(path))
    paths = (getattr(module, "__file__", None) for module in finder.modules.values())
    files = sorted(file for file in paths if file)
    return hashlib.sha256(b"".join(hashlib.sha256(Path(file).read_bytes()).digest() for file in files)).hexdigest()


def _point_of(name: str) -> importlib.metadata.EntryPoint | _InFile | None:
    """Return the entry point of a name; None for an unknown one."""
    return registered().get(name.split(":", 1)[0]) or (_InFile(name) if _IN_FILE.fullmatch(name) else None)


def registered() -> dict[str, importlib.metadata.EntryPoint]:
    """Return the entry point of every installed policy, by name: of several, swarm-pz's own or else the first."""
    return registered_in(GROUP)


def faults() -> dict[str, str]:
    """Return errors of entry points: of broken policies by name, of duplicates by name and package."""
    errors: dict[str, str] = {}
    known = registered()
    for point in entry_points(GROUP):
        where = f"policy {point.name!r} of {origin(point)} ({point.value})"
        if point != known[point.name]:
            taken = origin(known[point.name])
            errors[f"{point.name} of {origin(point)}"] = f"{where}: {taken} has a policy of that name already"
            continue
        try:
            factory = point.load()
        except FAULTS as error:
            errors[point.name] = f"{where} cannot be imported: {error!r}"
        else:
            if not callable(factory):
                errors[point.name] = f"{where} must be callable, got {factory!r}"
    return errors


def about(name: str) -> str:
    """Return the first line of an installed policy's docstring; an empty one for others."""
    factory = _factory_of(name)
    text = (factory.__doc__ or "").strip() if factory is not None else ""
    return str(text.splitlines()[0]) if text else ""


def kind_of(name: str) -> str:
    """Return the kind of an installed policy's commands; densities for others."""
    return str(getattr(_factory_of(name), "answers", "density"))


def is_constant(name: object) -> bool:
    """Test that something is the name of a tactic whose density is always the same, as `constant` marks it."""
    return isinstance(name, str) and hasattr(getattr(_factory_of(name), "play", None), "is_constant")


def _factory_of(name: str) -> Any:
    """Return the factory of a name; None if it cannot be imported, which `faults` explains."""
    try:
        point = _point_of(name)
        return None if point is None else point.load()
    except FAULTS:
        return None


def load(policy: str | Path | Player | Model, config: GameConfig, system: ControlSystem | None = None) -> Player:
    """Return the policy of a name or a folder, made for a game; a policy without `for_system` is returned as it is.

    A name may carry an argument after a colon, which its factory also takes: ``planner:ring`` is a planner
    that models its opponent as `ring`. A folder is one that training wrote. A model with `predict` and spaces, as those
    of Stable-Baselines3, becomes a `ModelPolicy`. `system` flies its team: the first of `config.controllers` if not
    given. Raises a PolicyError if there is no such name or folder, its policy cannot be made, or its commands do not
    fit that system, and a CheckpointError if a folder's files are missing, corrupt, or do not fit the game.
    """
    system = config.team_systems[0] if system is None else system
    if isinstance(policy, (str, Path)):
        return _check(_make(str(policy), config), f"policy {str(policy)!r}", config, system)
    if not isinstance(policy, (Policy, PrivilegedPolicy)) and isinstance(policy, Model):
        return ModelPolicy(policy, config, system=system)
    return _check(policy, f"policy {name_of(policy)}", config, system)


def _make(policy: str, config: GameConfig) -> object:
    if not policy.strip():
        raise PolicyError("a policy's name is empty: give one that swarm-pz policies lists, or a folder")
    points = registered()
    name, *argument = policy.split(":", 1)
    arguments: tuple[object, ...] = (config, *argument)
    if (point := _point_of(policy)) is not None:
        arguments = (config,) if isinstance(point, _InFile) else arguments
    elif Path(policy).is_dir():
        point, arguments = _reader_of(Path(policy)), (Path(policy), config)
    elif Path(policy).exists():
        python = policy.endswith(".py")
        hint = f"; name the tactic in it, too: {policy}:NAME" if python else f"; a program is exec:{policy}"
        raise PolicyError(f"expected a policy or a folder that training wrote, got the file {policy!r}{hint}")
    elif Path(policy).name != policy:
        raise PolicyError(
            f"there is no folder {policy!r}, nor a policy of that name; there are {', '.join(sorted(points))}"
        )
    else:
        raise PolicyError(f"there is no policy {name!r}, and no such folder; {nearest(name, points)}")
    try:
        return point.load()(*arguments)
    except SwarmError:
        raise
    except FAULTS as error:
        expected = f"; expected {_FACTORY}" if isinstance(point, _InFile) else ""
        raise PolicyError(f"policy {policy!r} ({point.value}) cannot be made: {error!r}{expected}") from error


def _reader_of(folder: Path) -> importlib.metadata.EntryPoint:
    """Return the entry point that reads a folder, by a file in it."""
    readers = registered_in(FOLDERS)
    for name, point in sorted(readers.items()):
        if (folder / name).is_file():
            return point
    expected = " or ".join(sorted(readers)) or "a file that some installed package reads"
    hint = "; give the folder of a run that is finished, or a name that swarm-pz policies lists"
    if any((folder / name).is_file() for name in ("league.json", "checkpoint.safetensors")):
        hint = "; a training writes it at its end, and this one stopped before: run its command again"
    raise CheckpointError(f"{folder} holds no policy: expected {expected} in it{hint}")


def _check(made: object, name: str, config: GameConfig, system: ControlSystem) -> Player:
    if not isinstance(made, (Policy, PrivilegedPolicy)):
        raise PolicyError(f"{name} must have reset, and observation and act or else plan, got {made!r}")
    player = made
    serves = answers_of(player) == "density" and serves_densities(system, config)
    if (serves or answers_of(player) in (system.takes, ANY)) and hasattr(player, "for_system"):
        player = cast("Player", player.for_system(system))
    kind = answers_of(player)
    if kind != system.takes and not serves:
        raise KindError(
            f"{name} answers commands of kind {kind!r}, but the control system {system.name} takes those of kind "
            f"{system.takes!r}: choose another policy, or another system by GameConfig.controllers"
        )
    return player


def folder_of(name: str) -> Path | None:
    """Return the folder of a name; None for an installed policy or a missing folder."""
    is_installed = name.split(":", 1)[0] in registered()
    return None if is_installed or not Path(name).is_dir() else Path(name)


def name_of(policy: str | Path | Player | Model) -> str:
    """Return the name of a policy for tables."""
    return str(policy) if isinstance(policy, (str, Path)) else str(getattr(policy, "name", type(policy).__name__))


def load_players(first: str | Player, second: str | Player, config: GameConfig) -> tuple[Player, Player]:
    """Load two policies that share nothing, even where the same object is given twice."""
    red, blue = config.team_systems
    one, other = load(first, config, red), load(second, config, blue)
    return one, copy.deepcopy(other) if other is one else other
