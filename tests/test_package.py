from __future__ import annotations

import shutil
import subprocess
import sys
import tarfile
import types
import zipfile
from pathlib import Path, PurePosixPath

import pytest

import swarm_pz

ROOT = Path(__file__).parents[1]


def test_the_public_surface_is_what_all_says():
    public = {
        name
        for name, value in vars(swarm_pz).items()
        if not name.startswith("_") and not isinstance(value, types.ModuleType)
    }
    assert public - {"version"} == set(swarm_pz.__all__)


def test_importing_the_package_is_light():
    heavy = [
        "torch",
        "stable_baselines3",
        "PIL",
        "pygame",
        "matplotlib",
        "tyro",
        "rich",
        "swarm_pz.policies",
        "swarm_pz.training",
    ]
    code = f"import sys, swarm_pz; print([name for name in {heavy} if name in sys.modules])"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout  # noqa: S603
    assert printed.strip() == "[]"


def test_folders_of_the_users_own_do_not_hide_ours(tmp_path):
    for name in ("policies", "training", "tests", "benchmarks"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("MINE = True\n")
    code = (
        "import policies, training; from swarm_pz import policies as ours; import swarm_pz.training.ppo; "
        "import swarm_pz; from swarm_pz.policy import kind_of; "
        "[ours.load(name) for name in ours.names() if kind_of(name) == 'density']; print(policies.MINE, training.MINE, "
        "type(ours.load('ring')).__name__)"
    )
    command = [sys.executable, "-c", code]
    printed = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path).stdout  # noqa: S603
    assert printed.split() == ["True", "True", "ScriptedPolicy"]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The names of all files in the wheel and in the source distribution, made from the files that git knows."""
    room = tmp_path_factory.mktemp("built")
    source = room / "source"
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout  # noqa: S607
    for name in filter(None, listed.decode().split("\0")):
        # Links are left out, as on a system that knows none.
        if (ROOT / name).is_file() and not (ROOT / name).is_symlink():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, source / name)
    for kind in ("wheel", "sdist"):
        code = f"from setuptools import build_meta; build_meta.build_{kind}({str(room)!r})"
        subprocess.run([sys.executable, "-c", code], cwd=source, capture_output=True, check=True)  # noqa: S603
    with zipfile.ZipFile(next(room.glob("*.whl"))) as wheel, tarfile.open(next(room.glob("*.tar.gz"))) as sdist:
        return wheel.namelist(), ["/".join(PurePosixPath(name).parts[1:]) for name in sdist.getnames()]


def test_what_is_installed_claims_one_name(built):
    wheel, _ = built
    assert {name.split("/")[0] for name in wheel} == {"swarm_pz", f"swarm_pz-{swarm_pz.__version__}.dist-info"}


def test_what_is_installed_is_complete(built):
    wheel, _ = built
    folders = {
        "swarm_pz": ROOT / "swarm_pz",
        "swarm_pz/policies": ROOT / "policies",
        "swarm_pz/training": ROOT / "training",
    }
    for inside, folder in folders.items():
        for path in folder.rglob("*"):
            is_ours = path.suffix in {".py", ".js", ".css", ".html", ".svg", ".safetensors", ".typed"}
            if is_ours and "__pycache__" not in path.parts:
                assert f"{inside}/{path.relative_to(folder).as_posix()}" in wheel, path


def test_the_source_distribution_holds_no_part_of_the_tests(built):
    _, sdist = built
    assert "pyproject.toml" in sdist and "policies/scripted.py" in sdist
    assert not [name for name in sdist if name.startswith("tests")]
