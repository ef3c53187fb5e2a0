"""The game in the page, held to the simulator: in Node and in a browser, from its own state at every tick."""

import pytest

from tests.play.conftest import new_page
from tests.play.engine_cases import ROOT, compare_in_node, write_cases

SEEDS = (11, 34, 39)
"""Of games of 6, 3 and 40 red drones against 6, 1 and 21 blue ones."""
ORIGIN = "http://engine.test"
COMPARE = """async seeds => {
    const { compare, compareDrawings } = await import("/tests/play/static/engine_cases.js");
    const given = async (path) => { const answer = await fetch(path); return answer.arrayBuffer(); };
    const cases = await (await fetch("/cases/cases.json")).json(), found = [compareDrawings(cases)];
    const weights = (name) => given(`/policies/zoo/${name}/policy.safetensors`);
    for (const seed of seeds) found.push(await compare(await given(`/cases/${seed}.game`), cases, weights));
    return found;
}"""


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    """Give a folder with games and drawings."""
    folder = tmp_path_factory.mktemp("engine") / "cases"
    folder.mkdir()
    write_cases(folder, SEEDS, seconds=15, every=10)
    return folder


def test_in_node(node, cases):
    ran = compare_in_node(node, cases)
    assert ran.returncode == 0, ran.stdout + ran.stderr


@pytest.mark.browser
def test_in_a_browser(chromium, cases):
    page = new_page(chromium)

    def answer(route):
        path = route.request.url.removeprefix(f"{ORIGIN}/")
        route.fulfill(path=(cases.parent if path.startswith("cases/") else ROOT) / path)

    page.route(f"{ORIGIN}/**", answer)
    page.route(f"{ORIGIN}/", lambda route: route.fulfill(body="<!doctype html>", content_type="text/html"))
    page.goto(f"{ORIGIN}/")
    found = page.evaluate(COMPARE, SEEDS)
    page.context.close()
    assert [one["faults"] for one in found] == [[]] * (1 + len(SEEDS))
    assert sum(one["captures"] for one in found[1:]) > 20
