"""Each module has its tests in the file that mirrors it, or in another that is named here."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HOMES = {
    "policies/learned": "policies/test_zoo",
    "policies/lookahead": "policies/test_planner",
    "swarm_pz/bench": "cli/test_cli",
    "swarm_pz/analysis/video": "rendering/test_painter",
    "swarm_pz/cli/compare": "cli/test_cli",
    "swarm_pz/cli/evidence": "figures/test_making",
    "swarm_pz/cli/learn": "training/test_commands",
    "swarm_pz/cli/machine": "cli/test_cli",
    "swarm_pz/cli/players": "policies/test_entry_points",
    "swarm_pz/cli/presets": "cli/test_cli",
    "swarm_pz/cli/report": "cli/test_cli",
    "swarm_pz/config/base": "config/test_game",
    "swarm_pz/config/constants": "config/test_game",
    "swarm_pz/config/sections": "config/test_game",
    "swarm_pz/envs/duel_batch": "envs/test_gymnasium_env",
    "swarm_pz/envs/reward": "envs/test_batch_env",
    "swarm_pz/evaluation/ladder": "evaluation/test_tournament",
    "swarm_pz/evaluation/ledger": "evaluation/test_tournament",
    "swarm_pz/evaluation/processes": "evaluation/test_tournament",
    "swarm_pz/figures/*": "figures/test_making",
    "swarm_pz/kernels/*": "kernels/test_mirror",
    "swarm_pz/kernels/controllers/ergodic": "kernels/test_mirror",
    "swarm_pz/play/server/room_settings": "play/server/test_room",
    "swarm_pz/policy/protocol": "policy/test_registry",
    "swarm_pz/rendering/board": "rendering/test_painter",
    "swarm_pz/rendering/window": "rendering/test_painter",
    "swarm_pz/simulator/parameters": "simulator/test_simulator",
    "swarm_pz/simulator/spawn": "simulator/test_simulator",
    "swarm_pz/spaces/densities": "spaces/test_formats",
    "training/checkpoint": "training/test_resuming",
    "training/config": "training/test_ppo",
    "training/exploit": "training/test_selfplay",
    "training/learner": "training/test_resuming",
    "training/networks": "training/test_ppo",
    "training/pool": "training/test_selfplay",
    "training/randomness": "training/test_resuming",
    "training/report": "training/test_ppo",
    "training/run_state": "training/test_callbacks",
}
"""Modules without a mirror of their own, and where their tests stand."""


def modules():
    """Return the paths, from the root and without suffix, of all modules that ship."""
    links = {ROOT / "swarm_pz" / "policies", ROOT / "swarm_pz" / "training"}
    found = [path for top in ("policies", "swarm_pz", "training") for path in (ROOT / top).rglob("*.py")]
    own = [path for path in found if not links & set(path.parents) and path.stem not in ("__init__", "__main__")]
    return sorted(path.relative_to(ROOT).with_suffix("") for path in own)


@pytest.mark.parametrize("module", modules(), ids=str)
def test_a_module_has_its_tests(module):
    mirror = ROOT / "tests" / module.relative_to("swarm_pz" if module.parts[0] == "swarm_pz" else ".")
    if mirror.with_name(f"test_{mirror.name}.py").is_file():
        assert str(module) not in HOMES, "it has a mirror: take it out of HOMES"
        return
    home = HOMES.get(str(module), HOMES.get(f"{module.parent}/*"))
    assert home is not None, f"{module} has neither {mirror.parent}/test_{mirror.name}.py nor another home in HOMES"
    assert (ROOT / "tests" / f"{home}.py").is_file()


def test_homes_are_of_modules_that_are_there():
    there = {str(module) for module in modules()} | {f"{module.parent}/*" for module in modules()}
    assert set(HOMES) <= there
