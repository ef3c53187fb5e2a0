"""Tables show every number under its heading, cut no number, and write no control character."""

from types import SimpleNamespace

import pytest

from swarm_pz.cli import printing as tables

LONG = "runs/a very long name of a folder, as people give them/with-more-of-it"
SUMMARY = {
    "games": 12345, "wins": 23456, "draws": 34567, "losses": 45678, "win_rate_ci95": (0.123, 0.987),
    "mean_share": 0.543, "restricted_mean_seconds": 6789.0,
}  # fmt: skip
MATCH = SimpleNamespace(
    policy=LONG, opponent="uniform", privileged=["uniform"], seed=7, limit_s=300.0, summary=lambda: SUMMARY,
    games=[0] * 9, forfeits=[SimpleNamespace(forfeit="too slow")],
)  # fmt: skip
STATUS = {
    "name": LONG, "code": "ABC", "step": "all done", "block": "block 9", "won": 3, "played": 4, "done": 11, "of": 12
}  # fmt: skip


@pytest.fixture
def printed(monkeypatch, capsys):
    """Print to a terminal of so many columns, or to a pipe; return the lines."""

    def printed(show, columns=None):
        monkeypatch.setenv("COLUMNS", str(columns or 60))
        if columns is not None:
            for name, value in {"TTY_COMPATIBLE": "1", "TERM": "dumb", "LINES": "25"}.items():
                monkeypatch.setenv(name, value)
        show()
        return capsys.readouterr().out.splitlines()

    return printed


SHOWN = [
    (
        lambda: tables.print_matches([MATCH]),
        "12345 23456 34567 45678 12 to 99 % 0.543 6789",
        ("against uniform*, both sides, seed 7", "share mean s", "won 95 %", "1 of 9 games are forfeits"),
    ),
    (
        lambda: tables.print_status("A study", [STATUS]),
        "all done block 9 3 of 4 11 of 12",
        ("A study", "name code step block won done"),
    ),
]  # fmt: skip


@pytest.mark.parametrize("columns", [60, 120, None])
@pytest.mark.parametrize(("show", "numbers", "words"), SHOWN, ids=["matches", "status"])
def test_numbers_stand_under_their_headings_and_names_are_whole(columns, show, numbers, words, printed):
    lines = printed(show, columns)
    assert any(numbers in " ".join(line.split()) for line in lines)
    text = " ".join(" ".join(lines).split())
    assert "…" not in text and (columns is not None or any(LONG in line for line in lines))
    assert columns is not None or [word for word in words if word not in text] == []
    assert columns != 120 or max(map(len, lines)) <= columns


def test_names_are_no_markup_and_control_characters_are_written_out(printed):
    names = {
        "[/p1]": "[/p1]",
        "[red]P1[/red]": "[red]P1[/red]",
        "\x1b[31m": "\\x1b[31m",
        "\t=1+1": "\\t=1+1",
        "a\\": "a\\ ",
    }
    text = "\n".join(printed(lambda: tables.print_status("", [STATUS | {"block": name} for name in names])))
    assert [shown for shown in names.values() if shown not in text] == []
    assert "\x1b" not in text and "\t" not in text
