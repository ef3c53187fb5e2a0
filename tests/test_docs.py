"""The pages keep their word: commands exist, snippets run, the site builds without a warning."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import json
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import swarm_pz.play.client
import swarm_pz.training.vec_env
from swarm_pz import GameConfig
from swarm_pz.cli import compare, data, export, learn, machine, main, standard, studies, table
from swarm_pz.play.factors import Factors
from swarm_pz.play.frames import Frame

ROOT = Path(__file__).parents[1]
FOR_BUILDERS = ["CONTRIBUTING.md", "docs/design.md"]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
COMMANDS = {
    learn: ("train", "sweep", "league"),
    compare: ("evaluate", "tournament", "list_policies"),
    studies: ("run", "status", "withdraw", "tables", "export"),
    table: ("play", "replay"),
    machine: ("render", "diagnose", "bench", "warmup"),
    data: ("dataset",),
    standard: ("benchmark",),
    export: ("export",),
}

FIRST_STEPS = [("git", "clone", "ADDRESS", "swarm-pz"), ("cd", "swarm-pz"), (".", ".venv/bin/activate")]
"""Lines of the README that are the shell's own."""


def snippets(language):
    """Return (page, text) of every fenced block of a language."""
    found = []
    for page in PAGES:
        name = str(page.relative_to(ROOT))
        found += [(name, text) for text in re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.M | re.S)]
    return found


def command_lines():
    """Return (page, line) of every line of a bash block, without comments."""
    lines = [(page, line) for page, text in snippets("bash") for line in text.splitlines()]
    return [(page, line) for page, line in lines if shlex.split(line, comments=True)]


@pytest.mark.parametrize(("page", "line"), command_lines())
def test_commands_of_the_pages_exist(page, line, monkeypatch):
    called = []
    for module, names in COMMANDS.items():
        for name in names:
            function = getattr(module, name)
            monkeypatch.setattr(module, name, functools.wraps(function)(lambda *_, **__: called.append(True)))
    program, *arguments = shlex.split(line, comments=True)
    if (program, *arguments) in FIRST_STEPS:
        assert page == "README.md"
    elif Path(program).name == "swarm-pz":
        main(arguments)
        assert called
    elif program == "python":
        path = f"{arguments[1].replace('.', '/')}.py" if arguments[0] == "-m" else arguments[0]
        path = path if (ROOT / path).is_file() else path.replace(".py", "/__main__.py")  # of a folder
        assert (ROOT / path).is_file()
        options = [argument for argument in arguments if argument.startswith("--")]
        text = (ROOT / path).read_text()
        assert all(f'"{one}"' in text or f"    {one[2:].replace('-', '_')}: " in text for one in options)
    else:
        assert program.startswith("scripts/"), f"{page} calls {program}, which this test cannot check"
        assert (ROOT / program).stat().st_mode & 0o100


def test_commands_named_in_the_text_exist(monkeypatch, capsys):
    named = {name for page in PAGES for name in re.findall(r"`swarm-pz ([a-z]+)", page.read_text())}
    assert {"train", "play", "evaluate"} <= named
    for name in named:
        with pytest.raises(SystemExit) as stopped:
            main([name, "--help"])
        assert stopped.value.code == 0, name


def test_scripts_named_in_the_text_exist():
    for page in PAGES:
        for name in re.findall(r"`(scripts/[a-z]+)", page.read_text()):
            assert (ROOT / name).is_file(), f"{page.name} names {name}"
        for name in re.findall(r"`python -m (benchmarks\.[a-z_]+)", page.read_text()):
            path = ROOT / name.replace(".", "/")
            assert path.with_suffix(".py").is_file() or (path / "__main__.py").is_file(), f"{page.name} names {name}"


@pytest.mark.parametrize("page", FOR_BUILDERS)
def test_files_that_are_named_to_builders_exist(page):
    named = re.findall(r"`([\w.-]*/[\w./-]*|[\w-]+\.(?:md|toml))`", (ROOT / page).read_text())
    assert named
    assert [name for name in named if not list(ROOT.glob(name.replace("NAME", "*").rstrip("/")))] == []


def test_the_designs_walk_goes_by_functions_that_are_there():
    steps = re.findall(r"`([\w.]+)` *\n? *\(`([\w/]+\.py)`\)", (ROOT / "docs/design.md").read_text())
    assert len(steps) >= 6
    for name, path in steps:
        *holder, function = name.split(".")
        text = (ROOT / path).read_text()
        assert f"def {function}(" in text and all(f"class {one}" in text for one in holder), f"{name} in {path}"


def test_the_designs_folders_are_the_layers_in_their_order():
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \|", (ROOT / "docs/design.md").read_text(), re.M)
    shown = [set(re.findall(r"\w+", row)) for row in rows]
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    assert shown == [set(re.findall(r"swarm_pz[.](\w+)", layer)) for layer in layers]


def parsed(name):
    """Return what a YAML file of the repository holds."""
    yaml = pytest.importorskip("yaml", reason="NO YAML: it comes with mkdocs, pip install 'swarm-pz[docs]' brings it")
    return yaml.safe_load((ROOT / name).read_text())


CITATION_FIELDS = {
    "abstract", "authors", "cff-version", "commit", "contact", "date-released", "doi", "identifiers",
    "keywords", "license", "license-url", "message", "preferred-citation", "references", "repository",
    "repository-artifact", "repository-code", "title", "type", "url", "version",
}  # fmt: skip
"""All that version 1.2.0 of the Citation File Format knows."""


def test_the_citation_is_of_its_format_and_says_what_the_package_says():
    citation, project = parsed("CITATION.cff"), tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert {"abstract", "authors", "cff-version", "keywords", "license", "message", "title"} <= set(citation)
    assert set(citation) <= CITATION_FIELDS
    assert (citation["license"], citation["version"]) == (project["license"], project["version"])
    assert set(citation["keywords"]) == set(project["keywords"])
    for reference in citation["references"]:
        assert {"type", "title", "authors", "year"} <= set(reference)
        assert set(reference["conference"]) == {"name"} and all("family-names" in one for one in reference["authors"])


def test_the_citation_is_of_this_version_its_holder_and_the_paper():
    citation = parsed("CITATION.cff")
    assert (citation["cff-version"], citation["type"]) == ("1.2.0", "software")
    assert citation["version"] == swarm_pz.__version__
    assert [author["name"] in (ROOT / "LICENSE").read_text() for author in citation["authors"]] == [True]
    (paper,) = citation["references"]
    cited = " ".join((ROOT / "README.md").read_text().split())
    assert paper["title"] in cited
    assert ", ".join(f"{one['given-names']} {one['family-names']}" for one in paper["authors"]) in cited


def test_forms_ask_what_is_needed_to_try_it_again():
    asked = {}
    for path in sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml")):
        form = parsed(path)
        assert form["name"] and form["description"]
        asked[path.stem] = {field["id"] for field in form["body"] if field["attributes"]["label"]}
    assert asked["bug"] == {"happened", "expected", "command", "version", "processor", "hash"}
    assert asked["idea"]


def test_the_page_of_commands_lists_all_of_them_as_their_help_does():
    commands = load("commands.py")
    assert commands.PAGE.read_text() == commands.page(), "docs/commands.md is out of date: python docs/commands.py"


def test_extras_named_in_the_text_exist():
    extras = set(tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"])
    named = {
        name
        for page in PAGES
        for part in re.findall(r"swarm-pz\[([\w,]+)\]", page.read_text())
        for name in part.split(",")
    }
    assert named and named <= extras


def test_the_readmes_links_lead_somewhere():
    text = (ROOT / "README.md").read_text()
    links = re.findall(r"\]\(([^)#:]+)[^)]*\)", text)
    assert links and [link for link in links if not (ROOT / link).exists()] == []


def test_what_the_players_page_calls_by_a_name_is_on_the_page_and_so_are_its_keys():
    static, page = ROOT / "swarm_pz/play/static", (ROOT / "docs/play.md").read_text()
    shown = (static / "index.html").read_text()
    named = re.findall(r"(?<!\*)\*([\w ]+)\*(?!\*)", page) + re.findall(
        r"under \*(\w+)\*", (ROOT / "README.md").read_text()
    )
    assert {"Go here", "send when I lift", "More"} <= set(named)
    assert [name for name in named if name not in shown] == []
    acts = re.search(r"const acts = {(.*?)};", (static / "table.js").read_text(), re.S)
    keys = set(re.findall(r'"?([^\s"]+?)"?: \(\) =>', acts[1])) - {"="}  # plus without Shift
    listed = set(re.findall(r"[^\s,|]+", " ".join(re.findall(r"^(\|[^|]*)\|", page.split("| key |")[1], re.M))))
    assert {"g", "+", "u", "Enter"} <= keys
    listed = {key.lower() if len(key) == 1 else key for key in listed}
    assert keys <= {key.replace("\N{MINUS SIGN}", "-") for key in listed}


def test_the_faces_that_the_readme_names_can_be_made():
    calls = re.findall(r"`((?:gymnasium|swarm_pz)\.[\w.]+\([^`]*\))`", (ROOT / "README.md").read_text())
    assert calls
    names = {"gymnasium": gymnasium, "swarm_pz": swarm_pz}
    for call in calls:
        eval(call, names).close()  # noqa: S307  (our own page)


def test_every_python_snippet_is_run(monkeypatch, capsys):
    """Doctests run by themselves; the others are programs at a table, which is played by a stand-in here.

    Those of docs/data.md read an export, which tests/play/studies/test_export.py makes for them; that of docs/ros.md
    plays in tests/play/ros/test_process.py, and that of docs/studies.md in tests/play/server/test_studies.py.
    """

    def stand_in(address, tactic, **how):
        generator = np.random.default_rng(0)
        positions, teams = generator.random((20, 2)), np.arange(20) // 10
        frame = Frame(sequence=1, tick=0, server_ms=0.0, positions=positions, velocities=np.zeros((20, 2)), teams=teams)
        density = np.array(tactic(frame, 0), float)
        assert density.shape == (10, 10)
        assert density.min() >= 0
        assert density.max() <= 1
        return "red"

    monkeypatch.setattr(swarm_pz.play.client, "play", stand_in)
    programs = [(page, text) for page, text in snippets("python") if ">>>" not in text and "--8<--" not in text]
    programs = [
        (page, text) for page, text in programs if page not in ("docs/data.md", "docs/ros.md", "docs/studies.md")
    ]
    for page, text in programs:
        assert "swarm_pz.play.client" in text, f"a snippet of {page} is run by no test: make it a doctest"
        exec(compile(text, page, "exec"), {})  # noqa: S102  (our own pages)
    assert capsys.readouterr().out == "red\n" * len(programs)


def test_toml_snippets_are_toml():
    for page, text in snippets("toml"):
        read = tomllib.loads(text)
        if page == "docs/factors.md":
            assert all(Factors.from_dict(read[team]) != Factors() for team in ("red", "blue"))
            continue
        groups = read["project"]["entry-points"]
        assert groups and set(groups) <= {"swarm_pz.policies", "swarm_pz.systems"}


def load(name):
    """Import a file of the documentation."""
    spec = importlib.util.spec_from_file_location(f"docs_{Path(name).stem}", ROOT / "docs" / name)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_ppo_in_one_file_runs(tmp_path, capsys, monkeypatch):
    few = {"steps": 64, "games": 4, "rollout": 8, "threads": 1, "evaluation-games": 2, "out": tmp_path / "ppo.pt"}
    options = [text for name, value in few.items() for text in (f"--{name}", str(value))]
    ppo = load("tutorials/ppo.py")
    monkeypatch.setattr(ppo, "play_match", functools.partial(ppo.play_match, config=GameConfig(time_limit=5.0)))
    monkeypatch.setattr(sys, "argv", ["ppo.py", *options])
    ppo.main()
    assert len(re.findall(r"steps  share", capsys.readouterr().out)) == 2
    assert (tmp_path / "ppo.pt").stat().st_size > 0


def test_ppo_values_time_outs_and_leaves_out_restarts():
    import torch

    ppo = load("tutorials/ppo.py")
    rewards, values, after = torch.zeros(2, 2), torch.zeros(2, 2), torch.ones(2, 2)
    over = torch.tensor([[True, True], [False, False]])
    ended = torch.tensor([[True, False], [False, False]])
    estimates = ppo.advantages(rewards, values, after, ended, over)
    assert estimates[0].tolist() == pytest.approx([0.0, ppo.GAMMA])


def test_ippo_runs_draws_its_curve_and_compares_with_random_accelerations(tmp_path, capsys, monkeypatch):
    few = {"steps": 256, "games": 2, "rollout": 16, "drones": 2, "time-limit": 4, "evaluation-games": 2}
    options = [text for name, value in (few | {"out": tmp_path}).items() for text in (f"--{name}", str(value))]
    monkeypatch.setattr(sys, "argv", ["ippo.py", *options])
    load("tutorials/ippo.py").main()
    assert "share above that of random: " in capsys.readouterr().out
    figures = json.loads((tmp_path / "figures.json").read_text())
    low, high = figures["share_above_random"]["ci95"]
    assert low <= figures["share_above_random"]["mean"] <= high
    assert figures["ippo.py"]["games"] + figures["random"]["games"] >= 2 and figures["steps"] == 256
    assert {path.name for path in tmp_path.iterdir()} == {"figures.json", "learning_curve.png", "model.zip"}


def public_names():
    """Return the names that docs/api/public.md lists, by module."""
    rows = re.findall(r"^\| `(swarm_pz[\w.]*)` \| (.*) \|$", (ROOT / "docs/api/public.md").read_text(), re.M)
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
    """Kernels are changed in a clone, and so are two tutorials about them."""
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
    """Give the folder of the built site."""
    if importlib.util.find_spec("mkdocs") is None:
        pytest.skip("NO SITE: mkdocs is not installed, pip install 'swarm-pz[docs]' brings it; pages are not checked")
    folder = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", str(ROOT / "mkdocs.yml")]
    done = subprocess.run([*build, "--site-dir", str(folder)], capture_output=True, text=True, cwd=ROOT, check=False)  # noqa: S603
    assert done.returncode == 0, done.stderr
    return folder


def test_the_site_builds_without_a_warning_and_fetches_nothing(site):
    for path in site.rglob("*.html"):
        loaded = re.findall(r'<(?:script|img|link|iframe)\b[^>]*?(?:src|href)="(https?:)?//', path.read_text())
        assert not loaded, f"{path.relative_to(site)} fetches from another host"
    assert "<math" in (site / "controller.html").read_text()
    assert "add_potential_gradient" in (site / "source/swarm_pz/kernels/controllers/ergodic.py.html").read_text()


def test_the_site_shows_the_board_and_the_notebook_where_pages_link_to_them(site):
    for page in ("index", "benchmark"):
        assert 'href="board/index.html"' in (site / f"{page}.html").read_text()
    assert 'href="source/examples/first_steps.ipynb.html"' in (site / "index.html").read_text()
    notebook = (site / "source/examples/first_steps.ipynb.html").read_text()
    assert "One game says little" in notebook and "cell_type" not in notebook


@pytest.mark.browser
def test_the_site_is_searched_from_files_without_a_server(site, chromium):
    context = chromium.new_context()
    page = context.new_page()
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto((site / "index.html").as_uri())
    page.click(".md-search__input")
    page.locator(".md-search__input").press_sequentially("trails and occupancy")
    page.locator(".md-search-result__item").first.locator("a").first.click()  # what explains comes before what lists
    page.wait_for_url("**/rules.html?h=*")
    elsewhere = [address for address in asked if not address.startswith(("file:", "about:", "blob:", "data:"))]
    context.close()
    assert not elsewhere
