"""A game as a trial of jsPsych 8, in the frame of an experiment that stands elsewhere."""

import functools
import http.server
import json
import threading
from pathlib import Path

import pytest
from playwright.sync_api import expect

from swarm_pz.play.recordings.format import CapturedLine, Recording
from tests.play.conftest import Table, new_page

DIST = Path(__file__).parent / "npm" / "node_modules" / "jspsych" / "dist"
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(not DIST.is_dir(), reason="jsPsych is not here: scripts/browser installs it, with npm"),
]
EXPERIMENT = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>An experiment</title>
<script src="jspsych.js"></script>
<script src="TABLE/static/jspsych-plugin-swarm-pz.js"></script></head><body></body>
<script>
  const jsPsych = initJsPsych({ on_finish: () => { window.rows = jsPsych.data.get().values(); } });
  jsPsych.run([{ type: jsPsychSwarmPz, table: "TABLE", result_duration: 100, load_timeout: 100000, ...TRIAL }]);
</script></html>"""
FORGE = """() => {
    const over = { type: "swarm-pz.over", row: { outcome: "forged" } };
    window.postMessage(over, "*");
    const other = Object.assign(document.createElement("iframe"), { src: "about:blank" });
    document.body.append(other);
    other.contentWindow.eval(`parent.postMessage(${JSON.stringify(over)}, "*")`);
    const begin = { type: "swarm-pz.begin", create: { opponent: "nobody" } };
    other.contentWindow.eval(`parent.frames[0].postMessage(${JSON.stringify(begin)}, "*")`);
}"""
"""Messages of windows that have no say: neither page follows them."""


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves a folder, and says nothing."""

    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """Give a folder and the address at which it is served: another origin than the table's."""
    folder = tmp_path_factory.mktemp("lab")
    (folder / "jspsych.js").write_bytes((DIST / "index.browser.min.js").read_bytes())
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield folder, f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture(scope="module")
def embedding(tmp_path_factory, lab):
    """Give a table that may be held in frames of the lab's pages."""
    server = Table(tmp_path_factory.mktemp("games"), "--embed", lab[1])
    yield server
    server.end()


@pytest.fixture
def experiment(chromium, lab, embedding):
    """Give a function that begins an experiment of one trial, perhaps by another name of the lab's machine."""
    folder, address = lab
    pages = []

    def begin(trial, name="127.0.0.1"):
        text = EXPERIMENT.replace("TABLE", f"http://{embedding.address.replace('localhost', '127.0.0.1')}")
        (folder / "index.html").write_text(text.replace("TRIAL", json.dumps(trial)))
        pages.append(new_page(chromium, 1280, 800))
        pages[-1].goto(address.replace("127.0.0.1", name) + "/index.html")
        return pages[-1]

    yield begin
    for page in pages:
        page.context.close()


def row_of(page):
    """Return the trial's row when the experiment is over."""
    page.wait_for_function("window.rows")
    (row,) = page.evaluate("window.rows")
    return row


def test_a_trial_is_a_game_and_returns_its_row(experiment, embedding):
    settings = {"time_limit": 15, "blue_system": "ergodic"}
    page = experiment({"opponent": "ring", "seat": "blue", "seed": 41, "settings": settings})
    page.evaluate(FORGE)
    frame = page.frame_locator("iframe").first
    frame.locator("#spread:not([disabled])").click()
    for name in ("leave", "go-home", "recording"):
        expect(frame.locator(f"#{name}")).to_be_hidden()
    row = row_of(page)
    recording = Recording.read(embedding.folder / row["recording"])
    assert row["trial_type"] == "swarm-pz" and row["error"] is None
    outcome = {"draw": "draw", "blue": "win", "red": "loss"}[recording.end.outcome]
    assert (row["outcome"], row["seconds"]) == (outcome, recording.end.tick / 30)
    assert (row["opponent"], row["side"], row["seed"], row["commands"]) == ("ring", "blue", 41, 1)
    taken = [capture.team for capture in recording.of(CapturedLine)]
    assert (row["captured"], row["lost"]) == (taken.count(1), taken.count(0))
    assert recording.header.seed == 41 and recording.header.red.policy == "ring"


@pytest.mark.parametrize(
    ("trial", "name", "told"),
    [
        ({"opponent": "nobody"}, "127.0.0.1", "no policy 'nobody'"),
        ({"load_timeout": 1000}, "localhost", "--embed http"),
    ],
)
def test_why_no_game_was_played_stands_in_the_row(trial, name, told, experiment):
    row = row_of(experiment(trial, name))
    assert row["outcome"] is None and told in row["error"]
