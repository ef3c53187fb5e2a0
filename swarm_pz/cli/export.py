"""The command ``export``: a policy as an ONNX file, which plays without the library that it was trained by."""

from __future__ import annotations

from pathlib import Path

from swarm_pz.cli.player_options import Player
from swarm_pz.cli.report import program
from swarm_pz.config import GameConfig
from swarm_pz.errors import CheckpointError, PolicyError, require_extra


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
        require_extra(module, "training")
    from swarm_pz.policies.learned import LearnedPolicy
    from swarm_pz.policy import load

    system = game.team_systems[0]
    found = None
    if policy.lower().endswith(".zip"):
        if not trust:
            raise CheckpointError(
                f"{policy} is a pickle, and opening it runs whatever code it holds: if you made it yourself, say "
                f"--trust; of others take nothing but ONNX files"
            )
    else:
        found = load(policy, game, system)
        if learned := getattr(found, "plays_as", ""):
            raise PolicyError(
                f"only networks can be exported, and {policy!r} is more than one: it plans. Export {learned!r} instead, "
                "which it plays where it does not"
            )
        if not isinstance(found, LearnedPolicy):
            raise PolicyError(
                f"only networks can be exported, and {policy!r} is none: expected a folder that training "
                f"wrote, a learned policy's name, or a file.zip of Stable-Baselines3"
            )
    for module in ("onnx", "onnxruntime", "onnxscript"):
        require_extra(module, "onnx")
    from swarm_pz.policies import exporting

    if found is None:
        exporting.export_model(exporting.load_model(Path(policy)), game, system, out, Path(policy).stem)
    else:
        exporting.export_learned(found, game, system, out)
    print(f"wrote {out}; try it: {program()} evaluate {out}")
