"""Browser tests of the folder that `swarm-pz site` writes, served as plain files."""

import re
import shutil

import pytest
from playwright.sync_api import expect

from swarm_pz.cli import main
from swarm_pz.play.protocol import SeatCommand
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from tests.play.pages import Hand, begin, check_places, eventually, wait_for_play, write_experiment
from tests.play.test_journeys import text_of

pytestmark = pytest.mark.browser
AT_ONCE = "?countdown=0"


@pytest.fixture
def site(lab):
    """Give the address of a site, and its folder."""
    folder, address = lab
    main(["site", str(folder / "swarm-pz")])
    return f"{address}/swarm-pz/", folder / "swarm-pz"


def tick_of(page):
    """Return the tick that is shown."""
    return int(page.locator("#arena").get_attribute("data-tick"))


def test_a_game_is_played_watched_saved_and_verified_and_needs_no_network(site, visit, tmp_path, capsys):
    address, folder = site
    page = visit(address + AT_ONCE, width=1000, height=700)
    expect(text_of(page, "quick")).to_be_enabled()
    for name in ("invite-somebody", "join"):
        expect(text_of(page, name)).to_be_hidden()  # these need a server
    page.goto(f"{address}{AT_ONCE}#play=uniform@7")
    page.click("#ready")
    wait_for_play(page)
    Hand(page).draw((0.2, 0.3), (0.4, 0.3))
    eventually(page, lambda: page.locator("#arena").get_attribute("data-target") == "1")
    drawn = tick_of(page)
    eventually(page, lambda: tick_of(page) > drawn + 66)  # play on for two seconds
    page.click("#leave")
    page.click("#leave-now")
    page.click("#recorded summary")
    page.click("#games a")
    expect(text_of(page, "scrubber")).to_be_visible()
    check_places(page, "replay")
    with page.expect_download() as saved:
        page.click("#save-recording")
    path = tmp_path / saved.value.suggested_filename
    saved.value.save_as(path)
    main(["replay", str(path), "--verify"])
    assert "played in a page" in capsys.readouterr().out
    recording = Recording.read(path)
    assert recording.header.seed == 7 and recording.end.ended_by == "left"
    assert any(line.strokes for line in recording.of(SeatCommand))
    page.goto(address + AT_ONCE)
    begin(page, "centre", time_limit="3")
    Hand(page).draw((0.2, 0.2), (0.2, 0.8), (0.8, 0.8), (0.8, 0.2), (0.2, 0.2))
    expect(text_of(page, "share")).to_be_visible()
    page.click("#share")
    page.click("#copy-game")
    shared = text_of(page, "sharing-text").input_value().split()[-1]
    assert "#replay=" in shared and len(shared) < 8000
    page.wait_for_function("navigator.serviceWorker.ready")  # unlike `evaluate`, it has a timeout
    shutil.rmtree(folder)
    page.goto(shared)  # the whole game is in the link
    expect(text_of(page, "scrubber")).to_be_visible()
    expect(text_of(page, "try")).to_have_attribute("href", re.compile(r"#play=centre@\d+$"))
    expect(text_of(page, "says")).to_be_empty()
    page.click("#close-replay")
    page.click("#recorded summary")
    expect(page.locator("#games a")).to_contain_text(
        ["you (red) against centre (blue)", "you (red) against uniform (blue)"]
    )
    page.click("#quick")
    wait_for_play(page)


RUN = """
  jsPsych.run([{
    type: jsPsychSwarmPz, engine: "page", opponent: "ring", seed: 41, settings: { time_limit: 3, speed: 2 },
    factors: { red: { command_delay_ms: 200, hide: ["opponents"] } }, result_duration: 0,
    save: async (...recording) => { window.saved = recording; },
  }]);"""


def test_an_experiment_of_files_alone_keeps_each_game_with_its_row(site, lab, visit, tmp_path):
    folder, address = lab
    write_experiment(folder, "swarm-pz", RUN)
    page = visit(f"{address}/index.html", width=1280, height=800)
    expect(page.frame_locator("iframe").locator("#varied")).to_have_text("Not shown here: your opponents.")
    page.wait_for_function("window.rows")
    (played,), (name, lines) = page.evaluate("[window.rows, window.saved]")
    assert (played["recording"], played["lines"], played["error"]) == (name, None, None)
    assert (played["command_delay_ms"], played["hide"]) == (200, "opponents")
    assert (played["outcome"], played["seconds"], played["opponent"], played["side"]) == ("draw", 3, "ring", "red")
    path = tmp_path / name
    path.write_text(lines)
    recording = Recording.read(path)
    assert Playback(recording).verify().verified and recording.header.seed == 41
    assert recording.config.factors[0].command_delay_ms == 200.0
