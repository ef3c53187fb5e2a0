"""A report that was left alone is confirmed; one that lies, or is spoilt, is refused before its files are opened."""

import hashlib
import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from swarm_pz.cli import main
from swarm_pz.config import GameConfig
from swarm_pz.errors import ResultsError
from swarm_pz.kernels.cache import processor
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.standard import Entry, Protocol, run, verify
from swarm_pz.standard import report as files
from swarm_pz.standard.page import render
from swarm_pz.standard.running import describe
from swarm_pz.standard.verifying import Verdict


@pytest.fixture
def copied(reported, tmp_path):
    """A copy of the report, which may be spoilt."""
    for name in (files.REPORT, files.GAMES, files.PAGE):
        shutil.copy(reported / name, tmp_path / name)
    for name in ("policies", "exploiters"):
        shutil.copytree(reported / name, tmp_path / name)
    return tmp_path


@pytest.fixture
def is_refused(copied, tiny):
    def is_refused(message, *policies):
        with pytest.raises(ResultsError, match=message):
            verify(copied, policies, protocol=tiny, games=1)

    return is_refused


def edit(folder, change):
    """Change a report, and sign it anew, as a forger would; the page is left where it cannot be made."""
    report = json.loads((folder / files.REPORT).read_text())
    change(report)
    report = files.signed(report)
    (folder / files.REPORT).write_text(json.dumps(report))
    (folder / files.PAGE).write_text(render(report))


def edit_games(folder, protocol, change):
    """Change the games of a report, and make all figures follow from them."""
    report, lines = files.read(folder)
    forged = list(map(change, lines))
    (folder / files.GAMES).write_bytes(files.encode_games(forged))
    edit(folder, lambda old: old.update(describe("two", report["policies"], report["attacks"], forged, protocol)))


def test_a_report_that_was_left_alone_is_confirmed(copied, tiny):
    verdict = verify(copied, protocol=tiny, games=1)
    assert verdict.check == "5 games played again are the same games", "one of each track"
    assert verdict.report["name"] == "two" and verdict.unchecked == () and not verdict.is_try


# --- changed files --------------------------------------------------------------------------------


def test_every_digit_counts(copied, is_refused):
    text = (copied / files.REPORT).read_text()
    places = [place for place, sign in enumerate(text) if sign.isdigit()]
    for place in places[:: len(places) // 40]:
        other = str((int(text[place]) + 1) % 10)
        (copied / files.REPORT).write_text(text[:place] + other + text[place + 1 :])
        is_refused("was changed|no report of format|is corrupt")


@pytest.mark.parametrize("name", [files.GAMES, files.PAGE])
def test_a_file_beside_it_that_is_changed_too_large_or_missing_is_refused(copied, is_refused, monkeypatch, name):
    (copied / name).write_text((copied / name).read_text().replace("1", "2", 1))
    is_refused(f"{name} was changed")
    monkeypatch.setitem(files._MOST, name, 10)
    is_refused(f"{name} is too large: expected 10 bytes")
    (copied / name).unlink()
    is_refused(f"{name} is missing")


def test_costs_change_the_checksum_and_not_the_signature(copied, is_refused):
    report = json.loads((copied / files.REPORT).read_text())
    other = files.signed(report | {files.COST: {"seconds": 1}})
    assert other["signature"] == report["signature"] and other["checksum"] != report["checksum"]
    (copied / files.REPORT).write_text(json.dumps(report | {"signature": "0" * 64}))
    is_refused("its signature is '0000")


@pytest.mark.parametrize(
    "content",
    [
        b"", b"[" * 100_000, b'{"format": 1, "score": NaN}', b'{"format": 1, "score": 1e999}',
        b'{"format": 2, "format": 1}', b"[1]", b"\xff\xfe",
    ],
    ids=["empty", "deep", "NaN", "endless", "twice", "a list", "no text"],
)  # fmt: skip
def test_a_file_that_is_no_report_is_refused(tmp_path, is_refused, content):
    (tmp_path / files.REPORT).write_bytes(content)
    is_refused("is corrupt|is no report of format 1")


@pytest.mark.parametrize(
    "spoilt", [{"outcome": "won"}, {"number": -1}, {"share": "1"}, {"policy": True}, {"policy": 100}]
)
def test_a_line_that_is_no_game_is_refused(copied, is_refused, spoilt):
    _, lines = files.read(copied)
    data = files.encode_games([lines[0]._replace(**spoilt), *lines[1:]])
    (copied / files.GAMES).write_bytes(data)
    edit(copied, lambda report: report["games"].update(sha256=hashlib.sha256(data).hexdigest()))
    is_refused("line 1 of .* is no game")


@pytest.mark.parametrize("name", ["policies", "exploiters/0"])
def test_links_to_other_folders_are_not_followed(copied, is_refused, name):
    (copied / name).rename(copied / "elsewhere")
    (copied / name).symlink_to(copied / "elsewhere")
    is_refused(f"expected {name.split('/')[0]}/0 in")


def test_links_and_huge_files_in_a_report_are_not_opened(copied, is_refused, tmp_path_factory):
    file = copied / "exploiters" / "1" / "policy.safetensors"
    elsewhere = tmp_path_factory.mktemp("elsewhere") / file.name
    shutil.move(file, elsewhere)
    file.symlink_to(elsewhere)
    is_refused("and no link")
    file.unlink()
    with file.open("wb") as sparse:
        sparse.truncate(2**33)
    is_refused("bytes or fewer")


# --- lies -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda report: report["figures"].update(score=0.999), "do not follow from the games"),
        (lambda report: report["seeds"].update(uniform=7), "do not follow"),
        (lambda report: report["policies"][0].update(digest="0" * 32), "is not the report's"),
        (lambda report: report["policies"][0].update(kept="../../policies/0"), "expected policies/0 in"),
        (lambda report: report["policies"][0].update(kind="planned"), "is learned, the report says 'planned'"),
        (lambda report: report["policies"][0].update(kept=None, name="../x"), "nor installed"),
        (lambda report: report["policies"][0].update(kept=None, name="planner:/x"), "nor installed"),
        (lambda report: report["cost"]["policies"][0].update(parameters=1), "'parameters': 1"),
        (lambda report: report["attacks"][0]["learned"].insert(0, "0" * 32), "expected 2 exploiters"),
        (lambda report: report["attacks"][1]["learned"].reverse(), "is not the report's exploiter"),
        (lambda report: report["attacks"][0].update(searched="siege 1"), "names no tactic|is no attack that"),
        (lambda report: report["protocol"].update(version="1-quick"), "is of protocol '1-quick'"),
        (lambda report: report["protocol"].update(digest="0" * 16), "is of protocol 'tiny'"),
        (lambda report: report.update(rules_hash="0" * 16), "are not those of protocol"),
        (lambda report: report.update(config_hash="0" * 16), "are not those of protocol"),
        (lambda report: report.update(name="<b>\n" * 30), "is of no entry"),
        (lambda report: report["policies"].pop(), "policies and attacks"),
        (lambda report: report["attacks"][1].update(policy=0), "policies and attacks"),
        (lambda report: report.update(figures=3), "holds no whole report"),
    ],
)
def test_a_report_that_lies_is_refused(copied, is_refused, change, message):
    try:
        edit(copied, change)
    except (TypeError, ValueError, LookupError):  # its page cannot be made, but its report is signed
        report = json.loads((copied / files.REPORT).read_text())
        assert files.signed(report)["checksum"] == report["checksum"]
    is_refused(message)


def test_games_that_nobody_played_and_attacks_on_others_are_found(copied, tiny, is_refused):
    forged = {"outcome": "win", "share": 1.0, "seconds": 2.0}
    edit_games(copied, tiny, lambda line: line._replace(**forged, fingerprint=f"{line.number:016d}"))
    is_refused("games came out differently: game")
    edit(copied, lambda old: old["cost"].update(processor="another"))
    with pytest.raises(ResultsError, match="more than chance does"):
        verify(copied, protocol=tiny, games=8)
    edit_games(copied, tiny, lambda line: line._replace(opponent=line.opponent.replace("siege ", "siege 1 ")))
    is_refused(r"'siege 1 .*' in games\.jsonl is no attack")


@pytest.mark.parametrize(
    "change",
    [
        lambda card: card.update(steps=255),
        lambda card: card["training"].update(total_steps=128),
        lambda card: card["training"].update(seed=2),
    ],
)
def test_a_weaker_exploiter_than_the_protocol_says_is_refused(copied, is_refused, change):
    place = copied / "exploiters" / "0"
    learned = LearnedPolicy.read(place, GameConfig())
    card = json.loads(json.dumps(learned.card))
    change(card)
    other = LearnedPolicy(card, learned.weights(), GameConfig(), "0")
    other.write(place)
    edit(copied, lambda report: report["attacks"][0]["learned"].__setitem__(0, other.digest))
    is_refused("was not trained as the protocol says")


def test_another_policy_than_the_reports_is_refused(is_refused):
    is_refused("of 2 policies, got 1", "ring")
    is_refused("policy hunter is not the report's", "hunter", "ring")


# --- elsewhere, tries and commands ----------------------------------------------------------------


def test_a_few_games_that_differ_on_another_processor_are_no_lie(copied, tiny, monkeypatch):
    """Chaotic games end otherwise there, though as well on the whole."""

    def otherwise(lines, protocol, factory, say):
        return [line._replace(seconds=line.seconds + 1.0, fingerprint="other") for line in lines]

    monkeypatch.setattr("swarm_pz.standard.verifying.play_again", otherwise)
    edit(copied, lambda old: old["cost"].update(processor="znver0"))
    verdict = verify(copied, protocol=tiny, seed=5)
    assert "no more than chance does" in verdict.check and verdict.seed == 5
    assert f"games differ here ({processor()}, the report was made on znver0, or" in verdict.check
    edit(copied, lambda old: old["cost"].update(processor=processor(), measured_on="another name for it"))
    with pytest.raises(ResultsError, match=r"games came out differently: .* \(seed 5\)"):
        verify(copied, protocol=tiny, seed=5)
    edit(copied, lambda old: old["versions"].update(numpy="1.0"))
    assert "or with other versions" in verify(copied, protocol=tiny).check


def test_what_nobody_has_checked_is_said(copied, tiny):
    better = {"over": "all", "signature": "", "probability": 1.0, "ci95": [1.0, 1.0]}
    edit(copied, lambda report: report["figures"].update(improvement=better))
    edit(copied, lambda report: report["versions"].update({"swarm-pz": "0.0"}))
    (copied / files.PAGE).write_text("<script>")
    page, comparison = verify(copied, protocol=tiny, games=1).unchecked
    assert page.startswith("index.html") and "another report" in comparison


def test_a_try_is_checked_and_said_to_be_one(tiny, tmp_path, capsys, monkeypatch):
    short = replace(tiny, version="2", tracks=tuple(replace(track, trials=track.trials[:1]) for track in tiny.tracks))
    few = replace(tiny.robust, games=2, steps=256, generations=1, candidates=2, search_games=2)
    quick = Protocol.quick
    monkeypatch.setattr(Protocol, "quick", lambda whole: replace(quick(whole), game=whole.game, robust=few))
    monkeypatch.setattr(Protocol, "read", lambda: short)
    run(Entry(policies=("halo",), name="a try"), tmp_path, protocol=short.quick())
    main(["benchmark", "--verify", str(tmp_path), "--games", "10"])
    said = capsys.readouterr().out
    assert "10 games played again are the same games" in said and "no entry" in said.splitlines()[-1]
    assert said.startswith("checking files") and "track generated: playing 2 games again\n" in said


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "policies must be at least one name"),
        (["ring", "--seed", "3"], "seed must be left out without verify"),
        (["--verify", "x", "--quick"], "verify must be given without"),
    ],
)
def test_a_command_that_cannot_be_is_refused(words, message, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["benchmark", *words])
    assert message in capsys.readouterr().err


def test_options_reach_what_is_done_and_the_figures_are_printed(reported, tmp_path, monkeypatch, capsys):
    report, _ = files.read(reported)
    figures = report["figures"] | {"score": 0.5, "score_ci95": [0.4, 0.625]}
    figures["improvement"] = {"over": "other", "signature": "", "probability": 0.7, "ci95": [0.6, 0.8]}
    figures["tracks"]["field"]["opponents"][0] |= {"forfeits": 3, "first_forfeit": "entry 0: broke"}
    called = []

    def begun(entry, out, **options):
        called.append((entry, out, options))
        return report | {"figures": figures}

    def verified(folder, policies, *, say, **options):
        called.append((folder, policies, options))
        return Verdict(report, "all is well", options["seed"])

    monkeypatch.setattr("swarm_pz.standard.run", begun)
    monkeypatch.setattr("swarm_pz.standard.verify", verified)
    words = ["--out", str(tmp_path), "--baseline", "other", "--processes", "3", "--quick"]
    main(["benchmark", "zoo/ring", "halo", *words])
    entry, out, options = called.pop()
    assert (entry.name, entry.policies, out) == ("ring", ("zoo/ring", "halo"), tmp_path)
    assert (options["protocol"].version, options["baseline"], options["pool"].count) == ("2-quick", Path("other"), 3)
    assert options["command"].startswith("swarm-pz benchmark zoo/ring halo")
    printed = capsys.readouterr().out
    assert "protocol: 2-quick" in printed and "better than other with probability 0.700 (0.600 to 0.800)" in printed
    assert "\nscore      0.500 (95 % interval over training seeds: 0.400 to 0.625)\n" in printed
    assert "forfeits: 3 of " in printed and "entry 0: broke" in printed
    main(["benchmark", "halo", "--verify", str(tmp_path), "--seed", "9"])
    assert called == [(tmp_path, ("halo",), {"games": 40, "seed": 9})]
    assert "all is well (sample of seed 9)" in capsys.readouterr().out
