"""The board: entries are what their reports say, and its pages can be used by everybody."""

import json
import re
import shutil

import pytest
from axe_playwright_python.sync_playwright import Axe

from benchmarks.board import ENTRIES, entries, page, replay
from swarm_pz.errors import ResultsError
from swarm_pz.standard import report as reports
from tests.standard.test_verifying import edit

CARD = {"by": "A lab", "notes": "Two of ours.", "link": "https://example.org/paper?a=1&b=2"}


@pytest.fixture(scope="module")
def place(reported, tiny, tmp_path_factory):
    """A folder with one entry."""
    place = tmp_path_factory.mktemp("entries")
    entries.add(reported, place, "two", CARD, games=1, protocol=tiny)
    return place


@pytest.fixture
def copied(place, tmp_path):
    """A copy of the entry, which may be spoilt."""
    return shutil.copytree(place / "two", tmp_path / "two")


# --- entries --------------------------------------------------------------------------------------


@pytest.mark.usefixtures("all_resamples")
@pytest.mark.parametrize("folder", entries.folders(ENTRIES), ids=lambda folder: folder.name)
def test_an_entry_is_what_its_report_says(folder):
    entries.check(folder, games=5, seed=0)


def test_an_added_entry_is_whole_and_no_name_stands_twice(place, reported, tiny):
    there = {path.relative_to(place / "two").as_posix() for path in (place / "two").rglob("*") if path.is_file()}
    learned = [f"{name}/policy" for name in ("policies/0", *(f"exploiters/{number}" for number in range(4)))]
    assert there == {*entries.NEEDED, *(f"{name}.{kind}" for name in learned for kind in ("json", "safetensors"))}
    assert (place / "two" / reports.REPORT).read_bytes() == (reported / reports.REPORT).read_bytes()
    for name in ("two", "..", "a/b", "A", "", "-a", "a" * 41):
        with pytest.raises(ResultsError, match="already" if name == "two" else "name must be"):
            entries.add(reported, place, name, CARD, games=1, protocol=tiny)


@pytest.mark.parametrize("name", ["A", "notes.txt"])
def test_other_folders_among_entries_are_refused(tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(ResultsError, match="is no entry"):
        entries.folders(tmp_path)


def link_to_policies(folder):
    shutil.move(folder / "policies", folder.parent / "elsewhere")
    (folder / "policies").symlink_to(folder.parent / "elsewhere")


def replace(name, old, new):
    def spoil(folder):
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new, 1))

    return spoil


def of_game(change):
    def spoil(folder):
        plain = json.loads((folder / replay.FILE).read_text())
        change(plain)
        (folder / replay.FILE).write_text(json.dumps(plain))

    return spoil


def put(data, *names):
    def spoil(folder):
        for name in names:
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(data)

    return spoil


def of_report(change):
    return lambda folder: edit(folder, change)


MOST = 4 * 2**20
SPOILT = {
    "a changed digit": (replace(reports.REPORT, '"score": 0.', '"score": 1.'), "was changed"),
    "no recorded game": (lambda folder: (folder / replay.FILE).unlink(), "replay.json is missing"),
    "another protocol": (of_report(lambda told: told["protocol"].update(version="1-quick")), "is of protocol"),
    "a link": (link_to_policies, "got a link"),
    "a pickle": (put(b"x", "policies/0/policy.pkl"), "policy.pkl belongs to no entry"),
    "large weights": (put(bytes(MOST + 1), "policies/1/policy.onnx"), "4,194,304 bytes"),
    "a large whole": (put(bytes(MOST), *(f"policies/{n}/policy.onnx" for n in range(1, 5))), "16,777,216 bytes"),
    "a hidden sign": (of_report(lambda told: told.update(name="a\u202eb")), "cannot be shown"),
    "a long text": (of_report(lambda told: told["cost"].update(command="a" * 4001)), "cannot be shown"),
    "a long name": (of_report(lambda told: told.update(name="a" * 61)), "its name must be"),
    "words as costs": (of_report(lambda told: told["cost"].update(ms_a_command=[])), "cannot be|must be"),
    "a card with more": (replace(entries.CARD, "by", "rank = 1\nby"), "'rank'"),
    "a nameless card": (replace(entries.CARD, "A lab", " "), "by in"),
    "two lines": (replace(entries.CARD, "Two of ours.", "a\\nb"), "on one line"),
    "long notes": (replace(entries.CARD, "Two of ours.", "a" * 301), "300 letters"),
    "a script's link": (replace(entries.CARD, "https://example.org", "javascript:alert"), "https://"),
    "another game": (of_game(lambda told: told.update(number=1)), "shows another game"),
    "a game cut short": (of_game(lambda told: told.update(positions="")), "cannot be|does not end as the report says"),
    "a game of noise": (of_game(lambda told: told.update(positions="AAA=")), "is corrupt"),
    "a forged capture": (of_game(lambda told: told["captures"].append([0, 99, 0])), "capture that cannot be"),
    "a game with more": (of_game(lambda told: told.update(more=1)), "has other fields"),
}


@pytest.mark.parametrize("what", SPOILT)
def test_a_spoilt_entry_is_refused(copied, tiny, what):
    spoil, message = SPOILT[what]
    try:
        spoil(copied)
    except (TypeError, ValueError):  # its page cannot be made, but its report is there
        assert what == "words as costs"
    with pytest.raises(ResultsError, match=message):
        entries.read(copied, tiny)


def test_moved_drones_in_a_recorded_game_are_found(copied, tiny):
    of_game(lambda told: told.update(positions=told["positions"].replace("a", "b")))(copied)
    with pytest.raises(ResultsError, match="does not show the game that it names"):
        entries.check(copied, games=1, protocol=tiny)


# --- pages ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pages(place, tiny, tmp_path_factory):
    """A folder with the pages of three entries, two of them with other figures."""
    several, out = tmp_path_factory.mktemp("several"), tmp_path_factory.mktemp("pages")
    shutil.copytree(place / "two", several / "two")
    edit(several / "two", lambda report: report["figures"].update(score=0.5))
    for name, score, commands in (("best", 0.98765, None), ("worst", 0.01, 5)):
        shutil.copytree(place / "two", several / name)

        def change(report, name=name, score=score, commands=commands):
            report["name"] = f"<b>{name}</b> & {{co}}"
            report["figures"].update(score=score, score_ci95=[score - 0.01, score + 0.01])
            report["cost"]["policies"][0].update(commands=commands)

        edit(several / name, change)
    for path, text in page.build(several, tiny).items():
        (out / path).parent.mkdir(exist_ok=True)
        (out / path).write_text(text)
    return out


def test_a_board_says_how_to_send_an_entry_in(pages, tmp_path, tiny):
    empty, whole = page.build(tmp_path, tiny)["index.html"], (pages / "index.html").read_text()
    for text in (empty, whole):
        assert ("There is no entry yet" in text) is (text is empty) and "scripts/board add" in text


def test_pages_escape_what_others_wrote_and_fetch_nothing(pages):
    for path in pages.rglob("*.html"):
        text = path.read_text()
        assert "<b>" not in text
        assert not re.findall(r'<(?:script|img|link|iframe)\b[^>]*?(?:src|href)="|url\(|@import', text)
        assert "Content-Security-Policy" in text and "default-src 'none'" in text
    assert "&lt;b&gt;best&lt;/b&gt; &amp; {co}" in (pages / "index.html").read_text()


def test_the_board_shows_kinds_and_the_players_of_the_clock_alone(pages):
    text = (pages / "index.html").read_text()
    assert text.count('<td data-value="learned, scripted">') == 3
    for kind, score in (("constant", "0.500"), ("sequence", "0.250")):
        assert re.search(rf"best {kind}<small>.*?</small></th><td></td><td></td><td></td><td>{score}</td>", text)


@pytest.fixture
def shown(pages, chromium):
    """Open a page as a file, on a screen of some width, and note what is requested and what fails."""
    contexts, requested, failed = [], [], []

    def show(name, width=1280, **how):
        contexts.append(chromium.new_context(viewport={"width": width, "height": 900}, **how))
        opened = contexts[-1].new_page()
        opened.on("request", lambda request: requested.append(request.url))
        opened.on("console", lambda message: failed.append(message.text) if message.type == "error" else None)
        opened.on("pageerror", lambda error: failed.append(str(error)))
        opened.goto((pages / name).as_uri())
        return opened

    yield show
    for context in contexts:
        context.close()
    assert failed == []
    assert [address for address in requested if not address.startswith("file:")] == []


def order(opened):
    return [text.split("</b>")[0].removeprefix("<b>") for text in opened.locator("tbody th > a").all_inner_texts()]


@pytest.mark.browser
def test_the_board_is_sorted_by_the_keyboard_and_in_order_without_its_script(shown):
    opened = shown("index.html", java_script_enabled=False)
    assert order(opened) == ["best", "two", "worst"] and opened.locator("button").count() == 0
    opened = shown("index.html")
    assert order(opened) == ["best", "two", "worst"]
    column = opened.get_by_role("columnheader", name="score", exact=True)
    assert column.get_attribute("aria-sort") == "descending"
    column.locator("button").focus()
    opened.keyboard.press("Enter")
    assert column.get_attribute("aria-sort") == "ascending" and order(opened) == ["worst", "two", "best"]
    opened.get_by_role("button", name="commands seen").press("Space")
    assert column.get_attribute("aria-sort") is None
    assert order(opened) == ["worst", "two", "best"], "few commands first, and last who says nothing"
    opened.get_by_role("button", name="method").press("Enter")
    assert order(opened) == ["best", "worst", "two"]


@pytest.mark.browser
@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (1280, "dark")])
def test_everybody_can_read_the_pages(shown, width, scheme):
    for name in ("index.html", "best/replay.html", "best/report.html"):
        opened = shown(name, width, color_scheme=scheme, bypass_csp=True)  # the policy keeps axe out, too
        assert opened.evaluate("document.documentElement.scrollWidth") == width, name
        assert Axe().run(opened).response["violations"] == [], name


@pytest.mark.browser
def test_a_game_is_replayed_from_a_file(shown):
    opened = shown("two/replay.html")
    told, canvas = opened.locator("#told"), opened.locator("canvas").element_handle()
    red, blue = re.match(r"0\.0 s: (.+) \(red\) 10, (.+) \(blue\) 10", told.inner_text()).groups()
    assert red != blue
    opened.get_by_role("slider").focus()
    opened.keyboard.press("End")
    end = told.inner_text()
    assert end.startswith("3.0 s")
    painted = "canvas => canvas.getContext('2d').getImageData(0, 0, 1152, 1152).data.some(Boolean)"
    assert opened.evaluate(painted, canvas)
    opened.get_by_role("button", name="Play").press("Enter")
    opened.wait_for_function("end => document.querySelector('#told').textContent !== end", arg=end)
    opened.wait_for_function("end => document.querySelector('#told').textContent === end", arg=end)
    assert opened.get_by_role("button", name="Play").count() == 1
