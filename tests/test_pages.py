"""Names, files and links on the pages exist, and the site builds without a warning."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from swarm_pz.cli import main

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


def text_of(name):
    """Return a file's text."""
    return (ROOT / name).read_text()


def test_commands_named_in_the_text_exist():
    named = {name for page in PAGES for name in re.findall(r"`swarm-pz ([a-z]+)", page.read_text())}
    assert {"train", "play", "evaluate"} <= named
    for name in named:
        with pytest.raises(SystemExit) as stopped:
            main([name, "--help"])
        assert stopped.value.code == 0, name


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "docs/design.md"])
def test_files_that_are_named_to_builders_exist(page):
    named = re.findall(r"`([\w.-]*/[\w./-]*|[\w-]+\.(?:md|toml))`", text_of(page))
    assert named
    assert [name for name in named if not list(ROOT.glob(name.replace("NAME", "*").rstrip("/")))] == []


def test_the_designs_folders_are_the_layers_in_their_order():
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \|", text_of("docs/design.md"), re.M)
    shown = [set(re.findall(r"\w+", row)) for row in rows]
    contracts = tomllib.loads(text_of("pyproject.toml"))["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    assert shown == [set(re.findall(r"swarm_pz[.](\w+)", layer)) for layer in layers]


def test_the_readmes_links_lead_somewhere():
    links = re.findall(r"\]\(([^)#:]+)[^)]*\)", text_of("README.md"))
    assert links and [link for link in links if not (ROOT / link).exists()] == []


def test_what_the_players_page_calls_by_a_name_is_on_the_page_and_its_help_lists_all_keys():
    static, page = ROOT / "swarm_pz/play/static", text_of("docs/play.md")
    source = "".join(path.read_text() for path in sorted(static.glob("*.js")))
    shown = (static / "index.html").read_text() + source
    named = re.findall(r"(?<!\*)\*([\w ]+)\*(?!\*)", page)
    assert {"Go here", "send when I lift", "More"} <= set(named)
    assert [name for name in named if name not in shown] == []
    acts = re.search(r"const acts = {(.*?)};", source, re.S)
    keys = set(re.findall(r'"?([^\s"]+?)"?: \(\) =>', acts[1])) - {"="}  # plus without Shift
    listed = set(" ".join(re.findall(r"<kbd>(.*?)</kbd>", shown)).split())
    assert {"g", "+", "u"} <= keys
    assert keys <= {key.lower().replace("\N{MINUS SIGN}", "-") for key in listed}


def public_names():
    """Return the names that docs/api/public.md lists, by module."""
    rows = re.findall(r"^\| `(swarm_pz[\w.]*)` \| (.*) \|$", text_of("docs/api/public.md"), re.M)
    return {module: set(re.findall(r"`(\w+)`", names)) for module, names in rows}


def test_the_page_of_public_names_lists_what_packages_export():
    named = public_names()
    named["swarm_pz.config"] |= {name for name in named["swarm_pz"] if name.endswith("Config")}
    assert len(named) > 10
    for module, names in named.items():
        exported = getattr(importlib.import_module(module), "__all__", None)
        missing = {name for name in names if not hasattr(importlib.import_module(module), name)}
        assert not missing, f"{module} has no {missing}"
        if module == "swarm_pz":
            assert names == set(exported)
        elif exported is not None:
            assert names <= set(exported), module


def test_examples_import_public_names_only():
    """Two tutorials change kernels in a clone, so they may import them."""
    named, imported = public_names(), 0
    named["swarm_pz.config"] |= named["swarm_pz"]
    for page in [*PAGES, *sorted((ROOT / "docs/tutorials").glob("*.py")), *sorted((ROOT / "examples").glob("*.py"))]:
        lines = re.findall(r"^(?:>>> |\.\.\. )?\s*from (swarm_pz[\w.]*) import ([\w, ]+)", page.read_text(), re.M)
        for module, names in lines:
            if module.startswith("swarm_pz.kernels"):
                assert page.name in ("controller.md", "rule.md")
                continue
            unknown = set(names.replace(" ", "").split(",")) - named.get(module, set())
            assert not unknown, f"{page.name} imports {unknown} of {module}, which docs/api/public.md does not list"
            imported += 1
    assert imported > 20


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Return the folder of the built site."""
    folder = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", str(ROOT / "mkdocs.yml")]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}  # no announcement of the theme
    done = subprocess.run(  # noqa: S603
        [*build, "--site-dir", str(folder)], capture_output=True, text=True, cwd=ROOT, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder


def test_the_site_builds_without_a_warning_fetches_nothing_and_links_to_pages_that_it_has(site):
    for path in site.rglob("*.html"):
        text = path.read_text()
        loaded = re.findall(r'<(?:script|img|link|iframe)\b[^>]*?(?:src|href)="(https?:)?//', text)
        assert not loaded, f"{path.relative_to(site)} fetches from another host"
        links = re.findall(r'href="([^"#?:]+)[#?"]', text) if path.name != "404.html" else []  # shown at any address
        missing = {link for link in links if not (path.parent / link).exists()}
        assert not missing, f"{path.relative_to(site)} links to {missing}"
    assert "<math" in (site / "controller.html").read_text()
    assert "integrate_costate" in (site / "source/swarm_pz/kernels/controllers/ergodic.py.html").read_text()
    assert "<table>" in (site / "source/docs/tables/examples.csv.html").read_text()


def test_the_site_shows_the_board_the_game_and_the_notebook_where_pages_link_to_them(site):
    assert 'href="game/index.html"' in (site / "index.html").read_text()
    assert {"index.html", "sw.js", "static"} == {path.name for path in (site / "game").iterdir()}
    for page in ("index", "benchmark"):
        assert 'href="board/index.html"' in (site / f"{page}.html").read_text()
    assert 'href="source/examples/first_steps.ipynb.html"' in (site / "index.html").read_text()
    notebook = (site / "source/examples/first_steps.ipynb.html").read_text()
    assert "One game says little" in notebook and "cell_type" not in notebook
