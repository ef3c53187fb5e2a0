"""The command ``export``: a policy as an ONNX file, which plays without the library that it was trained by."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from swarm_pz.cli.player_options import Player
from swarm_pz.cli.report import program, progress
from swarm_pz.config import GameConfig
from swarm_pz.errors import CheckpointError, PolicyError, require_extra

if TYPE_CHECKING:
    from swarm_pz.policies.learned import LearnedPolicy


def export(
    policy: Player,
    out: Path,
    /,
    trust: bool = False,
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Write a learned policy, or a model that Stable-Baselines3 saved, as an ONNX file with its card.

    Args:
        policy: Name of a learned policy, a folder that training wrote, or a file.zip of Stable-Baselines3.
        out: Folder to write, which is then a policy's name.
        trust: Open the file.zip. It is a pickle, and opening it runs whatever code it holds: say so of your own alone.
        game: The game that it plays: its number of drones, what is seen, and the control system.
    """
    from swarm_pz.policies.onnx_policy import check_new

    check_new(out)  # before libraries are imported, which takes seconds
    for module in ("torch", "stable_baselines3"):
        require_extra(module, "train")
    is_model, system = policy.lower().endswith(".zip"), game.team_systems[0]
    if is_model and not trust:
        raise CheckpointError(
            f"{policy} is a pickle, and opening it runs whatever code it holds: if you made it yourself, say "
            f"--trust; of others take nothing but ONNX files"
        )
    with progress("files", "exporting"):
        learned = None if is_model else _learned(policy, game)
        for module in ("onnx", "onnxruntime", "onnxscript"):
            require_extra(module, "train")
        from swarm_pz.policies import exporting

        if learned is None:
            exporting.export_model(exporting.load_model(Path(policy)), game, system, out, Path(policy).stem)
        else:
            exporting.export_learned(learned, game, system, out)
    print(f"wrote {out}; try it: {program()} evaluate {out}")


def _learned(policy: str, game: GameConfig) -> LearnedPolicy:
    from swarm_pz.policies.learned import LearnedPolicy
    from swarm_pz.policy import load

    found = load(policy, game, game.team_systems[0])
    if tactic := getattr(found, "plays_as", ""):
        raise PolicyError(
            f"only networks can be exported, and {policy!r} is more than one: it plans. Export {tactic!r} instead, "
            "which it plays where it does not"
        )
    if not isinstance(found, LearnedPolicy):
        raise PolicyError(
            f"only networks can be exported, and {policy!r} is none: expected a folder that training wrote, a learned "
            "policy's name, or a file.zip of Stable-Baselines3"
        )
    return found
