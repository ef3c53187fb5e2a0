from __future__ import annotations

from types import SimpleNamespace

import pytest

from swarm_pz.cli import printing as tables

LONG = "runs/a very long name of a folder, as people give them/with-more-of-it"
ENTRY = {
    "player": LONG, "kind": "learned", "rating": 1987.4, "rating_ci95": (1234.5, 2345.6), "wins": 12345,
    "draws": 23456, "losses": 34567, "median_seconds": 4567.0, "thinking_ms": 5678.9,
}  # fmt: skip
LADDER = {
    "players": [ENTRY],
    "games_per_pairing": 40,
    "seed": 0,
    "intransitivity": {"cyclic_share": 0.1, "cyclic_share_of_a_ladder": 0.02, "cycles": 3, "decided_triples": 9},
}
SUMMARY = {
    "games": 12345, "wins": 23456, "draws": 34567, "losses": 45678, "win_rate_ci95": (0.123, 0.987),
    "mean_share": 0.543, "restricted_mean_seconds": 6789.0,
}  # fmt: skip
STUDY = SimpleNamespace(
    player=LONG, opponent=LONG, wins=123, draws=456, losses=789, win_rate_low=0.12, win_rate_high=0.34,
    median_s=1234.0, restricted_mean_s=5678.0, commands_per_minute=98.7, min_command_interval=0.5,
    config_hash="0123456789abcdef", both_seats=False,
)  # fmt: skip
SPEEDS = {
    "machine": {"cpu": "some"},
    "speeds": [
        {"face": LONG, "games": 1024, "drones": 1000, "threads": 16, "drone_steps": 123.45e6, "env_steps": 1234567.0}
    ],
    "phases_ns_per_drone_step": {"solve": 1234.0},
    "bytes_per_game": 40960,
}


@pytest.fixture
def terminal(monkeypatch):
    """Give what makes a terminal of so many columns of what is printed to."""

    def of(columns):
        for name, value in {"TTY_COMPATIBLE": 1, "TERM": "dumb", "COLUMNS": columns, "LINES": 25}.items():
            monkeypatch.setenv(name, str(value))

    return of


def match():
    return SimpleNamespace(
        policy=LONG,
        opponent="uniform",
        privileged=[LONG],
        seed=0,
        limit_s=300.0,
        forfeits=[],
        games=[],
        summary=lambda: SUMMARY,
    )


@pytest.mark.parametrize("columns", [60, 80, 200])
@pytest.mark.parametrize(
    ("show", "numbers"),
    [
        (
            lambda: tables.print_matches([match()]),
            ("12345", "23456", "34567", "45678", "12 to 99 %", "0.543", "6789"),
        ),
        (
            lambda: tables.print_ladder(LADDER),
            ("1987", "1234 to 2346", "12345", "23456", "34567", "4567", "5678.9"),
        ),
        (lambda: tables.print_study([STUDY]), ("123-456-789", "12 to 34 %", "1234", "5678", "98.7")),
        (lambda: tables.print_speeds(SPEEDS), ("1024", "1000", "16", "123.45 M", "1,234,567")),
    ],
)
def test_names_are_cut_and_numbers_never(columns, show, numbers, capsys, terminal):
    terminal(columns)
    show()
    printed = capsys.readouterr().out
    row = next(line for line in printed.splitlines() if line.startswith("runs/"))
    for number in numbers:
        assert f" {number}" in row, row
    assert ("…" in row) == (columns < 200)


@pytest.mark.parametrize("columns", [80, 120])
def test_a_ladder_and_lists_fit_the_terminal(columns, capsys, terminal):
    terminal(columns)
    tables.print_ladder(LADDER)
    tables.print_named({"ring": "a word " * 40, "uniform": "even"})
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= columns
    assert "\nring     a word" in printed and "\n         " in printed and "\nuniform  even\n" in printed


def test_a_pipe_gets_whole_names(capsys, monkeypatch):
    """Names were cut at 80 columns where nobody looks on, so scripts could not read them."""
    monkeypatch.setenv("COLUMNS", "60")
    tables.print_ladder(LADDER)
    tables.print_named({"ring": "a word " * 40})
    printed = capsys.readouterr().out
    assert LONG in printed and "…" not in printed and "a word " * 39 in printed


def test_every_number_stands_under_its_heading(capsys):
    one = SimpleNamespace(
        policy="one", opponent="other", privileged=["other"], seed=7, limit_s=300.0, forfeits=[], games=[],
        summary=lambda: SUMMARY,
    )  # fmt: skip
    numbers = "12345 23456 34567 45678 12 to 99 % 0.543 6789"
    headings = "games won drawn lost won 95 % share mean s"
    for show, title, who in (
        (lambda: tables.print_matches([one]), "against other*, both sides, seed 7", ("policy", "one")),
        (lambda: tables.print_opponents([one], "a title"), "a title", ("opponent", "other*")),
    ):
        show()
        printed = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines() if line.strip()]
        assert printed[0] == title
        assert {f"{who[0]} {headings}", f"{who[1]} {numbers}"} <= set(printed)
        assert "draws count 300 s; * sees the simulator itself" in " ".join(printed)
    tables.print_ladder(LADDER)
    printed = " ".join(capsys.readouterr().out.split())
    assert "player kind rating 95 % won drawn lost median s ms" in printed
    assert "learned 1987 1234 to 2346 12345 23456 34567 4567 5678.9" in printed
    assert "10 % cyclic (2 % for a true ladder); 3 of 9 clear triples are cycles" in printed
    assert "40 games of every two, seed 0" in printed
    tables.print_speeds(SPEEDS)
    printed = " ".join(capsys.readouterr().out.split())
    assert "face games drones threads drone-steps env-steps" in printed
    assert " 1024 1000 16 123.45 M 1,234,567 " in printed and "solve 1234" in printed and "cpu some" in printed
    assert "a game's state takes 40 KiB" in printed
    tables.print_study([STUDY])
    printed = " ".join(capsys.readouterr().out.split())
    assert "won- commands player opponent drawn-lost won 95 % median s mean s a minute" in printed
    assert " 123-456-789 12 to 34 % 1234 5678 98.7 " in printed and "0.5 s apart at least" in printed


def test_names_are_text_and_no_markup_and_control_characters_are_written_out(capsys):
    names = ("[/p1]", "[red]P1[/red]", "\x1b[31m", "\t=1+1", "a\\")
    tables.print_study([SimpleNamespace(**vars(STUDY) | {"player": name, "opponent": "ring"}) for name in names])
    printed = capsys.readouterr().out
    for name in ("[/p1]", "[red]P1[/red]", "\\x1b[31m", "\\t=1+1", "a\\ "):
        assert name in printed
    assert "\x1b" not in printed and "\t" not in printed
    assert "config" not in printed.splitlines()[2]


def test_configurations_that_differ_are_told_apart(capsys):
    hashes = ("0123456789abcdef", "fedcba9876543210")
    tables.print_study([SimpleNamespace(**vars(STUDY) | {"config_hash": text}) for text in hashes])
    printed = capsys.readouterr().out
    assert "config" in printed and "012345" in printed and "fedcba" in printed
    assert "config: how config_hash begins, of the rules and the table's settings" in " ".join(printed.split())


def test_a_row_of_games_of_equals_says_whose_result_it_is(capsys):
    equals = SimpleNamespace(**vars(STUDY) | {"player": "P1", "opponent": "P1", "both_seats": True})
    tables.print_study([STUDY, equals])
    printed = " ".join(capsys.readouterr().out.split())
    assert "P1 the same 123-456-789" in printed and "each game counts once, as red's" in printed
