"""Each module has its tests in the file that mirrors it, or in another that is named here."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HOMES = {
    "swarm_pz/cli/compare": "cli/test_cli",
    "swarm_pz/cli/data": "cli/test_cli",
    "swarm_pz/cli/machine": "cli/test_cli",
    "swarm_pz/cli/player_options": "policies/test_entry_points",
    "swarm_pz/cli/report": "cli/test_cli",
    "swarm_pz/cli/standard": "standard/test_verifying",
    "swarm_pz/config/base": "config/test_game",
    "swarm_pz/config/constants": "config/test_game",
    "swarm_pz/config/installed": "policies/test_entry_points",
    "swarm_pz/config/presets": "test_variants",
    "swarm_pz/config/system": "systems/test_family",
    "swarm_pz/config/values": "simulator/test_commands",
    "swarm_pz/envs/drones_batch": "envs/test_drones_env",
    "swarm_pz/envs/one_game": "envs/test_parallel_env",
    "swarm_pz/envs/reward": "envs/test_batch_env",
    "swarm_pz/evaluation/ledger": "evaluation/test_tournament",
    "swarm_pz/kernels/*": "kernels/test_mirror",
    "swarm_pz/kernels/controllers/coverage": "systems/test_coverage",
    "swarm_pz/kernels/controllers/potential_field": "systems/test_potential_field",
    "swarm_pz/play/protocol/*": "play/test_protocol",
    "swarm_pz/play/recordings/moment": "play/server/test_replays",
    "swarm_pz/play/ros/connection": "play/ros/test_rosbridge",
    "swarm_pz/play/ros/definitions": "play/ros/test_cdr",
    "swarm_pz/play/server/budget": "play/server/test_attacks",
    "swarm_pz/play/server/control_thread": "play/server/test_systems",
    "swarm_pz/play/server/seat": "play/server/test_room",
    "swarm_pz/play/server/seat_policy": "play/server/test_room",
    "swarm_pz/play/server/server_context": "play/server/test_room",
    "swarm_pz/play/studies/bids": "play/studies/test_export",
    "swarm_pz/play/studies/psychds": "play/studies/test_export",
    "swarm_pz/play/studies/reading": "play/studies/test_export",
    "swarm_pz/play/studies/report": "play/studies/test_export",
    "swarm_pz/play/studies/rows": "play/studies/test_export",
    "swarm_pz/play/studies/tables": "play/studies/test_export",
    "swarm_pz/policy/protocol": "policy/test_names",
    "swarm_pz/spaces/densities": "spaces/test_formats",
    "swarm_pz/standard/report": "standard/test_verifying",
    "swarm_pz/systems/ergodic": "systems/test_family",
    "swarm_pz/systems/shapes": "systems/test_formation",
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
