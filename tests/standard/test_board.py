"""The board: an entry is policies and the report on them, and its pages are accessible."""

import json
import re
import shutil
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe

from benchmarks.board import ENTRIES, entries, page
from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.workers import SerialExecutor
from swarm_pz.policies import zoo
from swarm_pz.standard import Protocol
from swarm_pz.standard.report import REPORT, encode

CARD = {"by": "A lab", "notes": "Two of ours.", "link": "https://example.org/paper?a=1&b=2"}


@pytest.fixture(scope="module")
def place(reported, tiny, tmp_path_factory):
    """A folder with one entry, and its report."""
    place = tmp_path_factory.mktemp("entries")
    entries.add(["champion", "ring"], place / "two", CARD, tiny)
    shutil.copy(reported / REPORT, place / "two")
    return place


@pytest.fixture
def copied(place, tmp_path):
    """A copy of the entry, which may be spoilt."""
    return shutil.copytree(place / "two", tmp_path / "two")


def edit(folder, change):
    report = json.loads((folder / REPORT).read_text())
    change(report)
    (folder / REPORT).write_text(encode(report))


@pytest.mark.parametrize("folder", entries.folders(ENTRIES), ids=lambda folder: folder.name)
def test_an_entry_is_of_the_protocol_and_its_policies_are_the_reports(folder):
    entries.read(folder).check(Protocol.read())


def test_an_added_entry_holds_weights_or_names_of_installed_policies_and_a_card(place, tiny, tmp_path):
    assert [path.name for path in (place / "two").iterdir() if path.name != REPORT] == ["entry.toml"]
    assert entries.read(place / "two").policies == ("champion", "ring")
    champion = Path(zoo.__file__).parent / "champion"
    entry = entries.add([str(champion)], tmp_path / "weights", CARD, tiny)
    assert entry.policies == (str(tmp_path / "weights" / "policies" / "0"),) and entry.report is None
    for name in ("two", "A", "-a", "a" * 41):
        with pytest.raises(ResultsError, match="already" if name == "two" else "name must be"):
            entries.add(["champion", "ring"], place / name, CARD, tiny)
    with pytest.raises(ResultsError, match="must be a folder with weights"):
        entries.add([str(champion), "ring"], tmp_path / "other", CARD, tiny)
    assert not (tmp_path / "other").exists()
    with pytest.raises(ResultsError, match="has no report"):
        entry.check(tiny)


def test_all_other_entries_attack_an_entry_and_it_gets_the_report(reported, tiny, tmp_path, monkeypatch):
    attacked = {}

    def run(entry, out, *, protocol, attackers):
        attacked[entry.name] = dict(attackers)
        out.mkdir(parents=True, exist_ok=True)
        shutil.copy(reported / REPORT, out)

    monkeypatch.setattr(entries, "run", run)
    for name in ("champion", "ring", "halo"):
        entries.add([name], tmp_path / "all" / name, CARD, tiny)
    entries.play(tmp_path / "all", tiny, tmp_path / "work", ["ring"])
    assert attacked == {"ring": {"champion/0": "champion", "halo/0": "halo"}}
    assert [entry.name for entry in (tmp_path / "all").iterdir() if (entry / REPORT).exists()] == ["ring"]
    entries.play(tmp_path / "all", tiny, tmp_path / "work")
    assert attacked.keys() == {"champion", "ring", "halo"}


def test_a_newcomer_attacks_and_only_whom_it_beats_most_is_measured_again(place, reported, tiny, tmp_path):
    """Catches a newcomer whose attack is left out, or that becomes the worst attacker of an entry without a new run."""
    two = shutil.copytree(place, tmp_path / "all") / "two"
    played = shutil.copytree(reported, tmp_path / "work" / "two") / "work/uniform/games.jsonl"
    before, lines = entries.read(two).report, []

    def attackers():
        return {one["opponent"] for one in entries.read(two).report["figures"]["tracks"]["robust"]["opponents"]}

    def attack(name):
        entries.add([name], tmp_path / "all" / name, CARD, tiny)
        with SerialExecutor() as pool:
            entries.attack(tmp_path / "all", tiny, tmp_path / "work", name, pool=pool, say=lines.append)

    attack("uniform")
    report = entries.read(two).report
    assert "uniform/0" in attackers() and report["games"] == before["games"] + 2 * tiny.robust.choice_games
    assert report["figures"]["attacks"] == before["figures"]["attacks"] and not lines

    attack("halo")
    assert lines[0] == "halo beats two more than anybody before"
    assert {"uniform/0", "halo/0"} <= attackers()
    assert "halo/0" in {one["worst"]["opponent"] for one in entries.read(two).report["figures"]["attacks"]}
    assert played.read_bytes() == (reported / "work/uniform/games.jsonl").read_bytes(), "no game is played again"


@pytest.mark.parametrize("name", ["A", "notes.txt"])
def test_other_folders_among_entries_are_refused(tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(ResultsError, match="is no entry"):
        entries.folders(tmp_path)


def replace(old, new):
    def spoil(folder):
        text = (folder / entries.CARD).read_text()
        assert old in text
        (folder / entries.CARD).write_text(text.replace(old, new, 1))

    return spoil


SPOILT = {
    "another protocol": (
        lambda folder: edit(folder, lambda report: report["protocol"].update(version="1")),
        "is of protocol",
    ),
    "another policy's report": (
        lambda folder: edit(folder, lambda report: report["policies"][0].update(digest="0")),
        "of other policies",
    ),
    "a pickle": (lambda folder: (folder / "policy.pkl").touch(), "policy.pkl belongs to no entry"),
    "a card with more": (replace("by", "rank = 1\nby"), "'rank'"),
    "a nameless card": (replace("A lab", " "), "by in"),
    "two lines": (replace("Two of ours.", "a\\nb"), "on one line"),
    "long notes": (replace("Two of ours.", "a" * 301), "300 letters"),
    "a script's link": (replace("https://example.org", "javascript:alert"), "https://"),
}


@pytest.mark.parametrize("what", SPOILT)
def test_a_spoilt_entry_is_refused(copied, tiny, what):
    spoil, message = SPOILT[what]
    spoil(copied)
    with pytest.raises(ResultsError, match=message):
        entries.read(copied).check(tiny)


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
    for kind, score in (("constant", "0.500"), ("sequence", "0.250"), ("lap", "0.125")):
        assert re.search(rf"best {kind}<small>.*?</small></th><td></td><td></td><td></td><td>{score}</td>", text)


@pytest.fixture
def shown(pages, chromium):
    """Open a page as a file, on a screen of some width, and note what is requested and what fails."""
    contexts, requested, failed = [], [], []

    def show(name, width=1280, **options):
        contexts.append(chromium.new_context(viewport={"width": width, "height": 900}, **options))
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
    for name in ("index.html", "best/report.html"):
        opened = shown(name, width, color_scheme=scheme, bypass_csp=True)  # the page's security policy would block axe
        assert opened.evaluate("document.documentElement.scrollWidth") == width, name
        assert Axe().run(opened).response["violations"] == [], name
