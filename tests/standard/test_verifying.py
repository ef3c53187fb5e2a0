from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from swarm_pz.bench import machine
from swarm_pz.cli import main
from swarm_pz.config import GameConfig
from swarm_pz.errors import ResultsError
from swarm_pz.kernels.cache import processor
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.standard import Entry, Protocol, run, verify
from swarm_pz.standard import report as files
from swarm_pz.standard.games import Line
from swarm_pz.standard.page import render
from swarm_pz.standard.verifying import Verdict, _choose


@pytest.fixture
def copied(reported, tmp_path):
    """A copy of the report, which may be spoilt."""
    for name in (files.REPORT, files.GAMES, files.PAGE):
        shutil.copy(reported / name, tmp_path / name)
    for name in ("policies", "exploiters"):
        shutil.copytree(reported / name, tmp_path / name)
    return tmp_path


def edit(folder, change):
    """Change a report, and sign it anew, as who forges one would."""
    report = json.loads((folder / files.REPORT).read_text())
    change(report)
    report = files.signed(report)
    (folder / files.REPORT).write_text(json.dumps(report))
    (folder / files.PAGE).write_text(render(report))


def test_a_report_that_was_left_alone_is_confirmed(copied, tiny):
    verdict = verify(copied, protocol=tiny)
    assert verdict.check.endswith("games played again are the same games")
    assert verify(copied, protocol=tiny, games=1).check.startswith("5 games played again"), "one of each track"
    assert verdict.report["name"] == "two"


def test_every_digit_counts(copied, tiny):
    text = (copied / files.REPORT).read_text()
    places = [place for place, sign in enumerate(text) if sign.isdigit()]
    for place in places[:: len(places) // 40]:
        other = str((int(text[place]) + 1) % 10)
        (copied / files.REPORT).write_text(text[:place] + other + text[place + 1 :])
        with pytest.raises(ResultsError, match=r"was changed after it was written|no report of format|is corrupt"):
            verify(copied, protocol=tiny)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (files.GAMES, "was changed after it was written"),
        (files.PAGE, "was changed after it was written: it does not show"),
    ],
)
def test_a_changed_file_beside_it_is_named(copied, tiny, name, message):
    text = (copied / name).read_text()
    (copied / name).write_text(text.replace("1", "2", 1))
    with pytest.raises(ResultsError, match=message):
        verify(copied, protocol=tiny)


def test_figures_that_do_not_follow_from_the_games_are_refused(copied, tiny):
    edit(copied, lambda report: report["figures"].update(score=0.999))
    with pytest.raises(ResultsError, match=r"do not follow from the games"):
        verify(copied, protocol=tiny)


def test_games_that_nobody_played_are_found(copied, tiny):
    report, lines = files.read(copied)
    forged = [
        line._replace(outcome="win", share=1.0, seconds=2.0, fingerprint=f"{number:016d}")
        for number, line in enumerate(lines)
    ]
    (copied / files.GAMES).write_bytes(files.encode_games(forged))
    from swarm_pz.standard.running import describe

    edit(copied, lambda old: old.update(describe("two", report["policies"], report["attacks"], forged, tiny)))
    with pytest.raises(ResultsError, match="games came out differently: game"):
        verify(copied, protocol=tiny)
    edit(copied, lambda old: old["cost"].update(processor="another"))
    with pytest.raises(ResultsError, match="more than chance does"):
        verify(copied, protocol=tiny)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda report: report["policies"][0].update(digest="0" * 32), "is not the report's: expected digest"),
        (lambda report: report["policies"][0].update(kept="../../policies/0"), "expected policies/0 in"),
        (
            lambda report: report["policies"][0].update(privileged=True),
            "is wrong on whether policy .* sees the simulator",
        ),
        (lambda report: report["policies"][0].update(kept=None, name="../x"), "neither in the report's folder nor"),
        (
            lambda report: report["policies"][0].update(kept=None, name="planner:/x"),
            "neither in the report's folder nor",
        ),
        (lambda report: report["cost"]["policies"][0].update(parameters=1), "cost .*'parameters': 1.*, its card "),
        (lambda report: report["attacks"][0].update(digest="0" * 32), "is not the report's exploiter: expected '0000"),
        (lambda report: report["attacks"][0].update(learned="/etc"), "expected exploiters/0 in"),
        (lambda report: report["attacks"][0].update(searched="siege 1"), "names no tactic|is no attack that"),
        (lambda report: report["protocol"].update(version="7"), "the report is of protocol '7'"),
        (lambda report: report["protocol"].update(version="1-quick"), "the report is of protocol '1-quick'"),
        (lambda report: report.update(rules_hash="0" * 16), "are not those of protocol"),
        (lambda report: report.update(policies=[]), "is of no entry: policies must be one to 100"),
        (lambda report: report.update(name="<b>\n" * 30), "is of no entry: name must be 1 to 60 characters"),
        (lambda report: report["policies"].pop(), "policies and attacks in .* are not those in games.jsonl"),
        (lambda report: report["attacks"].pop(), "policies and attacks in .* are not those in games.jsonl"),
        (
            lambda report: report["attacks"][1].update(policy=0),
            "policies and attacks in .* are not those in games.jsonl",
        ),
        (lambda report: report.update(config_hash="0" * 16), "are not those of protocol"),
        (lambda report: report["protocol"].update(digest="0" * 16), "the report is of protocol 'tiny'"),
        (lambda report: report["seeds"].update(uniform=7), "do not follow"),
        (lambda report: report.update(figures=3), "holds no whole report"),
    ],
)
def test_a_report_that_lies_is_refused(copied, tiny, change, message):
    edit_without_page(copied, change)
    with pytest.raises(ResultsError, match=message):
        verify(copied, protocol=tiny)


@pytest.mark.parametrize("name", ["policies", "policies/0", "exploiters", "exploiters/0"])
def test_links_to_other_folders_are_not_followed(copied, tiny, name):
    (copied / name).rename(copied / "elsewhere")
    (copied / name).symlink_to(copied / "elsewhere")
    with pytest.raises(ResultsError, match=rf"expected {name.split('/')[0]}/0 in"):
        verify(copied, protocol=tiny)


def test_another_signature_is_refused(copied, tiny):
    report = json.loads((copied / files.REPORT).read_text())
    (copied / files.REPORT).write_text(json.dumps(report | {"signature": "0" * 64}))
    with pytest.raises(ResultsError, match="was changed after it was written: its signature is '0000"):
        verify(copied, protocol=tiny)


def test_costs_change_the_checksum_and_not_the_signature(reported):
    report = json.loads((reported / files.REPORT).read_text())
    other = files.signed(report | {files.COST: {"seconds": 1}})
    assert other["signature"] == report["signature"] and other["checksum"] != report["checksum"]


@pytest.mark.parametrize("name", [files.REPORT, files.GAMES, files.PAGE])
def test_a_file_that_is_too_large_is_refused(copied, tiny, monkeypatch, name):
    monkeypatch.setitem(files._MOST, name, 10)
    with pytest.raises(ResultsError, match=rf"{name} is too large: expected 10 bytes or fewer, got \d+"):
        verify(copied, protocol=tiny)


def test_the_seed_of_a_sample_is_told_and_chooses_it(reported):
    _, lines = files.read(reported)
    one, again, other = (_choose(lines, 10, seed) for seed in (1, 1, 2))
    assert one == again != other
    assert len(one) == len(set(one)) == 10
    assert {
        track: sum(line.track == track for line in one) for track in {line.track for line in lines}
    } == dict.fromkeys(["uniform", "field", "held-out", "systems", "robust"], 2)


def test_a_few_games_that_differ_elsewhere_are_no_lie(copied, tiny, monkeypatch):
    """What is chaotic ends otherwise on another processor, though as well on the whole."""

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
    # Of reports from before LLVM's name stood in them the processor's own is compared.
    edit(copied, lambda old: old["cost"].pop("processor"))
    assert "made on another name for it" in verify(copied, protocol=tiny, seed=5).check
    edit(copied, lambda old: old["cost"].update(measured_on=machine()["processor"]))
    with pytest.raises(ResultsError, match=r"games came out differently: .* \(seed 5\)"):
        verify(copied, protocol=tiny, seed=5)
    edit(copied, lambda old: old["versions"].update(numpy="1.0"))
    assert "or with other versions" in verify(copied, protocol=tiny).check


def test_it_is_said_what_is_being_checked(copied, tiny):
    said = []
    verify(copied, protocol=tiny, games=10, say=said.append)
    tracks = [f"track {name}: playing 2 games again" for name in ("uniform", "field", "held-out", "systems", "robust")]
    assert said == ["checking files, figures and policies", *tracks]


def test_a_try_is_checked_and_said_to_be_one(tiny, tmp_path, capsys, monkeypatch):
    short = replace(tiny, version="1", tracks=tuple(replace(track, trials=track.trials[:1]) for track in tiny.tracks))
    few = replace(tiny.robust, games=2, steps=256, generations=1, candidates=2, search_games=2)
    quick = Protocol.quick
    monkeypatch.setattr(Protocol, "quick", lambda whole: replace(quick(whole), game=whole.game, robust=few))
    monkeypatch.setattr(Protocol, "read", lambda: short)
    run(Entry(policies=("ring",), name="a try"), tmp_path, protocol=short.quick(), processes=1)
    main(["benchmark", "--verify", str(tmp_path), "--games", "5"])
    said = capsys.readouterr().out
    assert "5 games played again are the same games" in said and "no entry" in said.splitlines()[-1]
    assert verify(tmp_path, games=1).is_try


def edit_without_page(folder, change):
    try:
        edit(folder, change)
    except (TypeError, ValueError, LookupError):  # what the page cannot show
        report = json.loads((folder / files.REPORT).read_text())
        assert files.signed(report)["checksum"] == report["checksum"]


def test_an_attack_on_another_policy_is_none_on_this_one(copied, tiny):
    from swarm_pz.standard.running import describe

    report, lines = files.read(copied)
    others = [line._replace(opponent=line.opponent.replace("learned 0", "learned 1")) for line in lines]
    (copied / files.GAMES).write_bytes(files.encode_games(others))
    edit(copied, lambda old: old.update(describe("two", report["policies"], report["attacks"], others, tiny)))
    with pytest.raises(ResultsError, match=r"'learned 1' in games\.jsonl is no attack"):
        verify(copied, protocol=tiny)


def swap_exploiter(folder, change):
    """Put another exploiter into a report, as who wants a weak one would."""
    place = folder / "exploiters" / "0"
    learned = LearnedPolicy.read(place, GameConfig())
    card = json.loads(json.dumps(learned.card))
    change(card)
    other = LearnedPolicy(card, learned.weights(), GameConfig(), "0")
    other.write(place)
    edit(folder, lambda report: report["attacks"][0].update(digest=other.digest))


@pytest.mark.parametrize(
    "change",
    [
        lambda card: card.update(steps=255),
        lambda card: card["training"].update(total_steps=128),
        lambda card: card["training"].update(seed=1),
    ],
)
def test_an_exploiter_that_was_trained_otherwise_is_refused(copied, tiny, change):
    swap_exploiter(copied, change)
    with pytest.raises(ResultsError, match="was not trained as the protocol says: expected 256 commands"):
        verify(copied, protocol=tiny)


@pytest.mark.parametrize("place", ["policies/0/policy.json", "exploiters/1/policy.safetensors"])
def test_links_and_huge_files_in_a_report_are_not_opened(copied, tiny, place, tmp_path_factory):
    file = copied / place
    elsewhere = tmp_path_factory.mktemp("elsewhere") / file.name
    shutil.move(file, elsewhere)
    file.symlink_to(elsewhere)
    with pytest.raises(ResultsError, match="and no link"):
        verify(copied, protocol=tiny)
    file.unlink()
    with file.open("wb") as sparse:
        sparse.truncate(2**33)
    with pytest.raises(ResultsError, match="bytes or fewer"):
        verify(copied, protocol=tiny)


def test_what_nobody_has_checked_is_said(copied, tiny):
    assert verify(copied, protocol=tiny).unchecked == ()
    better = {"over": "all", "signature": "", "probability": 1.0, "ci95": [1.0, 1.0]}
    edit(copied, lambda report: report["figures"].update(improvement=better))
    edit(copied, lambda report: report["versions"].update({"swarm-pz": "0.0"}))
    (copied / files.PAGE).write_text("<script>")
    page, comparison = verify(copied, protocol=tiny).unchecked
    assert page.startswith("index.html, since another version wrote it")
    assert comparison == "how it compares with another report, whose games are not here"


def test_another_policy_than_the_reports_is_refused(copied, tiny):
    with pytest.raises(ResultsError, match="the report is of 2 policies, got 1"):
        verify(copied, ["ring"], protocol=tiny)
    with pytest.raises(ResultsError, match="policy hunter is not the report's"):
        verify(copied, ["hunter", "ring"], protocol=tiny)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is corrupt"),
        (b"[" * 100_000, "is corrupt"),
        (b'{"format": 1, "score": NaN}', "NaN is no number of JSON"),
        (b'{"format": 1, "score": 1e999}', "is corrupt: Out of range"),
        (b'{"format": 2, "format": 1}', "is corrupt: a name stands twice"),
        (b"[1]", "is no report of format 1"),
        (b"\xff\xfe", "is corrupt"),
    ],
)
def test_a_file_that_is_no_report_is_refused(tmp_path, content, message):
    (tmp_path / files.REPORT).write_bytes(content)
    with pytest.raises(ResultsError, match=message):
        verify(tmp_path)


def test_a_folder_without_a_report_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["benchmark", "--verify", str(tmp_path)])
    assert "there is no report in" in capsys.readouterr().err


@pytest.mark.parametrize(
    "spoilt", [{"outcome": "won"}, {"number": -1}, {"share": "1"}, {"policy": True}, {"policy": 100}]
)
def test_a_line_that_is_no_game_is_refused(copied, tiny, spoilt):
    _, lines = files.read(copied)
    data = files.encode_games([lines[0]._replace(**spoilt), *lines[1:]])
    (copied / files.GAMES).write_bytes(data)
    import hashlib

    edit(copied, lambda report: report["games"].update(sha256=hashlib.sha256(data).hexdigest()))
    with pytest.raises(ResultsError, match=r"line 1 of .* is no game"):
        verify(copied, protocol=tiny)


def test_a_line_is_written_as_it_is_read():
    line = Line("uniform", 0, "uniform", 3, "win", 1.0, 12.5, "ab", "")
    assert [Line(**json.loads(row)) for row in files.encode_games([line]).splitlines()] == [line]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["benchmark"], "policies must be at least one name"),
        (["benchmark", "ring", "--seed", "3"], "seed must be left out without verify"),
        (["benchmark", "--verify", "x", "--quick"], "verify must be given without"),
    ],
)
def test_options_that_do_not_fit_are_refused(arguments, message, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(arguments)
    assert message in capsys.readouterr().err


def test_options_reach_what_is_done(reported, tmp_path, monkeypatch, capsys):
    report, _ = files.read(reported)
    report["figures"]["improvement"] = {"over": "other", "signature": "", "probability": 0.7, "ci95": [0.6, 0.8]}
    report["figures"]["score_ci95"] = [0.4, 0.625]
    called = []

    def run(entry, out, **options):
        called.append((entry, out, options))
        return report

    def verified(folder, policies, **options):
        called.append((folder, policies, options))
        return Verdict(report, "all is well", options["seed"])

    monkeypatch.setattr("swarm_pz.standard.run", run)
    monkeypatch.setattr("swarm_pz.standard.verify", verified)
    words = ["--out", str(tmp_path), "--baseline", "other", "--processes", "3", "--quick"]
    main(["benchmark", "zoo/ring", "halo", *words])
    printed = capsys.readouterr().out
    (entry, out, options) = called.pop()
    assert (entry.name, entry.policies, out) == ("ring", ("zoo/ring", "halo"), tmp_path)
    assert options["protocol"].version.endswith("-quick") and (options["baseline"], options["pool"].count) == (
        Path("other"),
        3,
    )
    assert options["command"].startswith("swarm-pz benchmark zoo/ring halo")
    assert "protocol: 1-quick" in printed and "better than other with probability 0.700 (0.600 to 0.800)" in printed
    score, (low, high) = report["figures"]["score"], report["figures"]["score_ci95"]
    assert f"score      {score:.3f} (95 % interval over training seeds: {low:.3f} to {high:.3f})" in printed
    report["figures"]["score_ci95"] = [report["figures"]["score"]] * 2
    report["figures"]["tracks"]["field"]["opponents"][0] |= {"forfeits": 3, "first_forfeit": "entry 0: broke"}
    games = sum(task["games"] for track in report["figures"]["tracks"].values() for task in track["opponents"])
    main(["benchmark", "ring", "--out", str(tmp_path)])
    printed = capsys.readouterr().out
    assert f"\nscore      {score:.3f}\n" in printed, "an interval without width says nothing"
    assert f"forfeits: 3 of {games} games, the first since entry 0: broke" in printed
    main(["benchmark", "ring", "--name", "mine", "--out", str(tmp_path)])
    assert called[-1][0].name == "mine" and not called[-1][2]["protocol"].version.endswith("-quick")
    main(["benchmark", "halo", "--verify", str(tmp_path), "--seed", "9"])
    assert called[-1][2].pop("say") is not None
    assert called[-1] == (tmp_path, ("halo",), {"games": 40, "seed": 9})
    assert "all is well (sample of seed 9)" in capsys.readouterr().out
