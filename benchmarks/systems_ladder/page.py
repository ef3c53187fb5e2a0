"""The page of the ladder of systems, and its tables."""

from __future__ import annotations

from typing import Any

from benchmarks.systems_ladder.contest import TRACKS, TRAINED
from benchmarks.systems_ladder.traits import LOST, REACHED, SIZES, TALK

_CHANGES = {
    "size": f"{SIZES[1]} drones, not {SIZES[0]}",
    "permutation": "drones in another order",
    "captured": f"{100 * LOST:g} % captured",
    "leader": "middle drone captured",
    "talk": f"heard within {TALK:g}",
}
"""What is changed, as the table's columns say it."""
_RULES = {
    "hovering": [
        "The default rules. [A parked drone is hard to capture](parking.md), and it captures drones that fly through",
        "its ring. Coverage, formations and potential fields rest while their command does not change, so nearly any",
        "command wins for them against a team that flies, and they draw with each other. This follows from the",
        "paper's rule of capture, not from skill.",
    ],
    "fixed_wing": [f"The preset `fixed_wing`: a drone flies at {TRACKS['fixed_wing']:g} or faster, and cannot park."],
}
"""What each track's section begins with."""
_FEWEST = 10
"""Games of every two, below which a page says nothing about systems."""
_SHOWN = 0.005
"""Share of a mixture from which on an entrant is named."""


def to_markdown(results: dict[str, Any], pictures: str) -> str:
    """Return the page; `pictures` is the folder of its pictures, seen from it."""
    config, tracks = results["config"], results["tracks"]
    parts = [
        ["# Control systems compared"],
        [
            "Which [control system](control_systems.md) wins most? Each is commanded by its best player: a script for",
            "its kind of commands, or a policy that was trained for it. All play all. A win is 1, a draw 0.",
        ],
        ["```bash", results["command"] or "python -m benchmarks.systems_ladder", "```"],
        *([["**Few and short games: this page only shows that everything works.**"]] * (config["games"] < _FEWEST)),
        [f"- {line}" for line in _answers(results)],
        [
            "**The value.** Let each side choose an entrant. A draw is worth 0 to both, so wins alone are no zero-sum",
            "game. Two numbers stand for its value. The *guaranteed share* is what the best mixture of entrants wins,",
            "whatever the other side chooses. The *mixture* is the equilibrium of wins less losses, a zero-sum game of",
            "value 0: nobody wins more games against it than they lose.",
        ],
        [
            f"All played {config['games']} games with each other, half from each side, from the same starts.",
            f"{config['pilot_games']} other games against `{results['adversary']}` [chose the",
            "players](tables/systems_scripts.csv). [All numbers](tables/systems.csv). Policies had 500,000 steps for",
            "hovering, and 150,000 more for fixed wing (`scripts/systems`).",
        ],
        *(part for track in tracks for part in _track(track, tracks[track], f"{pictures}/{track}.png")),
        [f"![Mean time to a win against the adversary]({pictures}/time_to_win.png)"],
        [
            f"*Mean time to a win against `{results['adversary']}`, with 95 % intervals, as in the tables. A game that",
            f"is not won counts {config['game']['time_limit']:g} s.*",
        ],
        ["## Traits"],
        [
            "[The table of traits](tables/systems_traits.csv) has ergodic metrics, times 1000, of a team alone that",
            f"flies {config['seconds']} s: of even coverage in both tracks, and of a target that the system can reach.",
            "Changes show by which factor the metric of this target grows. The last columns are of a target of two",
            f"modes: how many of {config['starts']} teams reach {1000 * REACHED:g}, and with how many commands.",
        ],
    ]
    return "\n\n".join("\n".join(part) for part in parts) + "\n"


def tables(results: dict[str, Any]) -> dict[str, list[tuple[Any, ...]]]:
    """Return the rows of the page's tables, by the name of each."""
    standings: list[tuple[Any, ...]] = [
        ("track", "system", "commands", "by", "won against all others, %", "share of the mixture, %", "won", "drawn",
         "lost", "forfeited", "won, 95 %", "mean length, s", "mean time to a win, s", "new commands a minute"),
    ]  # fmt: skip
    scripts: list[tuple[Any, ...]] = [("track", "system", "script", "won", "drawn", "lost")]
    for track, told in results["tracks"].items():
        for row in told["standings"]:
            low, high = row["win_rate_ci95"]
            shares = (f"{100 * row['against_all']:.1f}", f"{100 * row['mixture']:.1f}")
            counts = (row["wins"], row["draws"], row["losses"], row["forfeits"])
            times = (_interval(row["length"], 0), _interval(row["time_to_win"], 0))
            rates = (f"{100 * low:.0f} to {100 * high:.0f} %", *times, _interval(row["commands_a_minute"], 1))
            standings.append((track, row["system"], row["takes"], row["player"], *shares, *counts, *rates))
        pilot = [(*row["entrant"].split("/", 1), row["wins"], row["draws"], row["losses"]) for row in told["pilot"]]
        scripts += [(track, *row) for row in sorted(pilot)]
    modes = ("two modes reached", "commands needed, median", "metric of two modes")
    even = (f"even, {_words(track)}" for track in TRACKS)
    traits: list[tuple[Any, ...]] = [("system", *even, "own target", "its metric", *_CHANGES.values(), *modes)]
    for row in results["traits"]:
        covered = (f"{1000 * row['even'][track]['mean']:.2f}" for track in TRACKS)
        own = (row["target"], f"{1000 * row['own']['mean']:.2f}")
        factors = (_interval(row[name], 2) for name in _CHANGES)
        traits.append((row["system"], *covered, *own, *factors, *_modes(row["bimodal"])))
    return {"systems": standings, "systems_traits": traits, "systems_scripts": scripts}


def _answers(results: dict[str, Any]) -> list[str]:
    """Return who wins most in each track, and whether coverage wins."""
    lines = []
    for track, told in results["tracks"].items():
        best = told["standings"][0]
        lines.append(
            f"**{_words(track).capitalize()}**: `{best['system']}` wins most, commanded by {_by(best)}: "
            f"{100 * best['against_all']:.0f} % of the games against all others."
        )
    covering = [row for row in results["traits"] if row["target"] == "even"]
    for track, told in results["tracks"].items() if covering else ():
        places = list(dict.fromkeys(row["system"] for row in told["standings"]))
        most = min(covering, key=lambda row: row["even"][track]["mean"])["system"]
        lines.append(
            f"Does better coverage win? {_words(track).capitalize()}: `{most}` covers most evenly, and is "
            f"number {places.index(most) + 1} of {len(places)}."
        )
    return lines


def _track(track: str, told: dict[str, Any], picture: str) -> list[list[str]]:
    """Return a track's section: its rules, its table, what the game is worth, and its picture."""
    game = told["game"]
    lines = ["| system | by | won against all, % | time to a win, s | mixture, % |", "|---|---|---|---|---|"]
    for row in told["standings"]:
        shares = (f"{100 * row['against_all']:.0f}", f"{row['time_to_win']['mean']:.0f}", f"{100 * row['mixture']:.0f}")
        lines.append(f"| `{row['system']}` | {_by(row)} | {' | '.join(shares)} |")
    mixed = _named(told, game["mixture"])
    sentences = [
        f"The guaranteed share of wins is **{100 * game['guaranteed']:.0f} %**. The mixture is {mixed}; against itself",
        f"it wins {100 * game['wins']:.0f} % of the games, and loses as many.",
    ]
    if max(game["guaranteed"], game["wins"]) < _SHOWN:
        sentences.append("So among these players, the game is worth a draw.")
    learned = [row["entrant"].split("/", 1)[0] for row in told["pilot"] if row["entrant"].endswith(f"/{TRAINED}")]
    trained = f"Policies were trained for {', '.join(f'`{system}`' for system in sorted(learned)) or 'none'}."
    return [
        [f"## {_words(track).capitalize()}"],
        [*_RULES[track], trained],
        lines,
        sentences,
        [f"![Who beats whom, and the mixture]({picture})"],
    ]


def _words(track: str) -> str:
    return track.replace("_", " ")


def _named(told: dict[str, Any], shares: list[float]) -> str:
    pairs = sorted(zip(shares, told["order"], strict=True), key=lambda pair: -pair[0])
    return ", ".join(f"`{name}` {100 * share:.0f} %" for share, name in pairs if share >= _SHOWN)


def _by(row: dict[str, Any]) -> str:
    return "a trained policy" if row["player"] == TRAINED else f"`{row['player']}`"


def _interval(value: dict[str, Any] | None, digits: int) -> str:
    if value is None:
        return "-"
    low, high = value["ci95"]
    return f"{value['mean']:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def _modes(found: dict[str, Any] | None) -> tuple[str, str, str]:
    if found is None:
        return "-", "-", "-"
    needed = "-" if found["commands"] is None else f"{found['commands']:g}"
    ends = {"mean": 1000 * found["metric"]["mean"], "ci95": [1000 * end for end in found["metric"]["ci95"]]}
    return f"{found['reached']} of {found['starts']}", needed, _interval(ends, 2)
