from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from pathlib import Path, PurePosixPath

import pytest

import swarm_pz

ROOT = Path(__file__).parents[1]
OURS = {".py", ".js", ".css", ".html", ".jinja", ".svg", ".json", ".safetensors", ".typed"}


def printed_by(code, **options):
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True, **options).stdout  # noqa: S603


def test_the_package_and_its_kernels_import_nothing_heavy_and_folders_of_the_users_own_do_not_hide_ours(tmp_path):
    for name in ("policies", "training", "tests", "benchmarks"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("MINE = True\n")
    heavy = ["torch", "stable_baselines3", "PIL", "pygame", "matplotlib", "tyro", "rich", "scipy.linalg", "jax"]
    heavy += ["swarm_pz.policies", "swarm_pz.training"]
    code = (
        f"import sys, swarm_pz; swarm_pz.Simulator().reset([0]); print([it for it in {heavy} if it in sys.modules]); "
        "import policies, training; from swarm_pz import policies as ours; import swarm_pz.training; "
        "print(policies.MINE, training.MINE, type(ours.load('ring')).__name__)"
    )
    assert printed_by(code, cwd=tmp_path) == "[]\nTrue True ScriptedPolicy\n"


def test_the_command_line_is_a_module_too_and_the_package_leaves_ctrl_c_alone():
    code = (
        "import runpy, signal, sys; sys.argv = ['swarm-pz', '--version']; old = signal.getsignal(2); import swarm_pz; "
        "print(signal.getsignal(2) is old); runpy.run_module('swarm_pz', run_name='__main__')"
    )
    assert printed_by(code) == f"True\nswarm-pz {swarm_pz.__version__}\n"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Return the folder of a wheel and a source archive.

    Both are built from the files that git tracks, without symbolic links, as on a system that has none.
    """
    folder = tmp_path_factory.mktemp("built")
    source = folder / "source"
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout  # noqa: S607
    for name in filter(None, listed.decode().split("\0")):
        if (ROOT / name).is_file() and not (ROOT / name).is_symlink():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, source / name)
    room = str(folder)
    printed_by(f"from setuptools import build_meta as b; b.build_wheel({room!r}); b.build_sdist({room!r})", cwd=source)
    return folder


def test_a_wheel_is_complete_and_claims_one_name_and_an_archive_holds_no_tests(built):
    with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel, tarfile.open(next(built.glob("*.tar.gz"))) as sdist:
        installed = wheel.namelist()
        archived = ["/".join(PurePosixPath(name).parts[1:]) for name in sdist.getnames()]
    assert {name.split("/")[0] for name in installed} == {"swarm_pz", f"swarm_pz-{swarm_pz.__version__}.dist-info"}
    for inside in ("swarm_pz", "swarm_pz/policies", "swarm_pz/training"):
        folder = ROOT / "swarm_pz" if inside == "swarm_pz" else ROOT / inside.removeprefix("swarm_pz/")
        for path in folder.rglob("*"):
            if path.suffix in OURS and "__pycache__" not in path.parts:
                assert f"{inside}/{path.relative_to(folder).as_posix()}" in installed, path
    assert "pyproject.toml" in archived and "policies/scripted.py" in archived
    assert not [name for name in archived if name.startswith("tests")]


def test_what_a_wheel_installs_plays_films_and_writes_the_page_without_the_clone(built, tmp_path):
    with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel:
        wheel.extractall(tmp_path)  # noqa: S202  (our own)
    for kept in (ROOT / "swarm_pz" / "kernels").rglob("__pycache__"):  # machine code, found by its sources' digest
        shutil.copytree(kept, tmp_path / kept.relative_to(ROOT), copy_function=shutil.copy, dirs_exist_ok=True)
    code = f"""
import doctest, pathlib, swarm_pz
from swarm_pz.cli import main
from swarm_pz.standard import Protocol
print(swarm_pz.__file__, doctest.testfile({str(ROOT / "README.md")!r}, module_relative=False))
Protocol.read().check()  # its players are those that it names: weights, drawings, scripts
main("evaluate champion --opponent best_sequence --games 2 --game.time-limit 5 --json match.json".split())
main("render champion ring --seconds 2 --out film.mp4".split())
main("site page".split())
"""
    # -S skips site, which would find the clone; so the path names the libraries' folder.
    path = os.pathsep.join([str(tmp_path), sysconfig.get_path("purelib")])
    command = [sys.executable, "-S", "-c", code]
    done = subprocess.run(command, cwd=tmp_path, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True)  # noqa: S603
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"{tmp_path / 'swarm_pz' / '__init__.py'} TestResults(failed=0, attempted=")
    assert {"match.json", "film.mp4"} <= {path.name for path in tmp_path.iterdir()}
    assert {"index.html", "sw.js", "static"} == {path.name for path in (tmp_path / "page").iterdir()}
