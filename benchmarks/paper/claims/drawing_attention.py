"""What it costs to draw: while a drawing is made, the last command stays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.figure import Figure, Finding, Interval, estimate, games_as_red
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import CommandError
from swarm_pz.evaluation.intervals import bootstrap, rounded
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.policy import Policy, load
from swarm_pz.simulator.spawn import Seed

GAMES = 100
SECONDS = 60
"""Seconds of each game that count, at most."""
TACTIC = "ring"
OPPONENTS = ("ring", "uniform")
"""Who never draws: the same tactic, which commands every second, and one that commands once."""
DRAWING = (0, 1, 2, 3, 5, 8)
"""Seconds that a drawing takes; 0 commands at once, every second."""
JUDGED = 3

Array = NDArray[np.float64]
Look = Literal["begin", "send"]
LOOKS: tuple[Look, ...] = ("begin", "send")


class Drawer:
    """Plays a tactic as somebody who needs some seconds to draw: looks, draws, sends, and looks again.

    What it sends is an answer to what it saw when it began to draw (or, to compare, when it sends); until then its last
    command stays, at first uniform coverage.
    """

    def __init__(self, tactic: Policy, seconds: int, looks: Look = "begin") -> None:
        self.name = f"drawer-{seconds}-{looks}"
        self.observation: ObservationConfig = tactic.observation
        self._tactic, self._seconds, self._looks = tactic, seconds, looks

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin games, all of them together."""
        self._tactic.reset(seeds, rows)
        self._step = 0

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> Array:
        """Answer n observations with densities (n, A, A)."""
        if self._seconds == 0:
            return np.asarray(self._tactic.act(observations, rows), np.float64)
        if self._step % self._seconds == 0:
            seen = np.asarray(self._tactic.act(observations, rows), np.float64)
            if self._step == 0:
                shape = int(rows.max()) + 1, *seen.shape[1:]
                self._sent, self._drawn = np.ones(shape), np.ones(shape)
            self._sent[rows] = seen if self._looks == "send" else self._drawn[rows]
            self._drawn[rows] = seen
        self._step += 1
        return self._sent[rows]


def tally(seconds: int, opponent: str, seed: int, looks: Look = "begin") -> Array:
    """Play, and return of each game (n, 3) the drones lost, the seconds played, and the share of drones in the end."""
    config = GameConfig()
    tactic = load(TACTIC, config)
    if not isinstance(tactic, Policy):
        raise CommandError(f"expected a policy that sees what its side may see, got {TACTIC!r}")
    rollout = Rollout(Drawer(tactic, seconds, looks), opponent, games_as_red(GAMES), seed=seed, config=config)
    rollout.play(SECONDS)
    simulator = rollout.simulator
    lost = simulator.games.captures[:, 1]  # by blue
    return np.stack([lost, simulator.time_s, simulator.sizes[:, 0] / config.num_drones], axis=1).astype(np.float64)


def lost_a_minute(games: Array) -> Any:
    """Return the drones lost a minute over games (n, 3)."""
    lost, seconds, _ = games.sum(axis=0)
    return 60.0 * lost / seconds


def more_lost(games: Array) -> Any:
    """Return how many more drones a minute are lost in the second of two tallies (n, 2, 3) of the same starts."""
    return lost_a_minute(games[:, 1]) - lost_a_minute(games[:, 0])


def measure(seed: int) -> Finding:
    """Play with drawings that take longer and longer, from the same starts; and as seldom, without looking away."""
    judged, games = DRAWING.index(JUDGED), {}
    for opponent in OPPONENTS:
        at_once = tally(0, opponent, seed)
        for looks in LOOKS:
            games[opponent, looks] = [at_once, *(tally(seconds, opponent, seed, looks) for seconds in DRAWING[1:])]
    drawn, away = f"more_lost_a_minute_by_{JUDGED}_s_of_drawing", f"more_lost_a_minute_by_looking_away_for_{JUDGED}_s"
    pairs = {
        f"{name}_against_{opponent}": (games[opponent, looks][place], games[opponent, "begin"][judged])
        for name, looks, place in ((drawn, LOOKS[0], 0), (away, LOOKS[1], judged))
        for opponent in OPPONENTS
    }
    more = {name: estimate(np.stack(two, axis=1), more_lost) for name, two in pairs.items()}
    found = {
        opponent: {
            looks: {
                "lost": [rounded(bootstrap(row, lost_a_minute)) for row in games[opponent, looks]],
                "share": [rounded(bootstrap(row[:, 2])) for row in games[opponent, looks]],
            }
            for looks in LOOKS
        }
        for opponent in OPPONENTS
    }
    return Finding(
        numbers={**more},
        method=f"bootstrap over {GAMES} starts, which all share",
        holds={f"against {opponent}": more[f"{drawn}_against_{opponent}"][1][0] > 0 for opponent in OPPONENTS},
        seen=_describe(found, {opponent: more[f"{drawn}_against_{opponent}"] for opponent in OPPONENTS}),
        configs={"paper": GameConfig()},
        seeds=[seed],
        series=found,
    )


def _describe(found: dict[str, Any], more: dict[str, tuple[float, Interval]]) -> str:
    judged = DRAWING.index(JUDGED)
    text = (
        f"`{TACTIC}` looks, draws for some seconds, and then sends; its last command stays meanwhile. {GAMES} games "
        f"from the same starts, {SECONDS} s of each at most."
    )
    for opponent, rows in found.items():
        late, prompt = ([lost for lost, *_ in rows[looks]["lost"]] for looks in LOOKS)
        value, (low, high) = more[opponent]
        text += (
            f" Against `{opponent}` it loses {late[0]:.0f} drones a minute if it commands at once, every second, and "
            f"{late[judged]:.0f} if a drawing takes {JUDGED} s ({value:+.1f}, {low:+.1f} to {high:+.1f}); if it "
            f"commands as seldom, but answers what it sees then, {prompt[judged]:.0f}; with {DRAWING[-1]} s "
            f"{late[-1]:.0f} and {prompt[-1]:.0f}."
        )
        if high < 0:
            text += " So it loses fewer."
    return text + (
        " This is the price of time, not of attention. For people, `swarm-pz study tables` counts `lost_while_drawing`."
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw what is lost, and what is left, by the seconds that a drawing takes."""
    left, right = figure.subplots(1, 2)
    for number, (opponent, by_look) in enumerate(series.items()):
        for looks, fmt, face, text in zip(
            LOOKS, ("o-", "s:"), (style.SERIES[number], "white"), ("draws so long", "commands as seldom"), strict=True
        ):
            for axes, name, factor in ((left, "lost", 1), (right, "share", 100)):
                value, low, high = factor * np.transpose(by_look[looks][name])
                look: dict[str, Any] = {"fmt": fmt, "color": style.SERIES[number], "markerfacecolor": face}
                style.whisker(axes, np.array(DRAWING), value, low, high, label=f"{text}, against {opponent}", **look)
    left.set(ylabel="drones lost a minute", xlabel="seconds between two commands (0: at once, every second)")
    left.set_ylim(bottom=0)
    style.mark(right, 50, "even")
    right.set(ylabel=f"share of all drones after {SECONDS} s (%)", xlabel="seconds between two commands", ylim=(0, 100))
    style.legend_below(figure, left)


FIGURE = Figure(
    name="drawing_attention",
    title="What it costs to draw: the price of time",
    claim="Drawing takes time, in which the last command stays and drones are lost.",
    section="IV-B",
    quote="requires the player to consider the amount of time they take to send commands to their swarm",
    paper="The paper says that players who draw detailed targets look at their drawing, not at the swarms, whose "
    "sizes change within seconds.",
    rule=f"Who needs {JUDGED} s for a drawing loses more drones a minute than who commands at once, by the same tactic "
    "from the same starts, against each of two opponents, with the whole interval of the difference.",
    measure=measure,
    draw=draw,
    size=(11.0, 4.3),
    seconds=16,
    revised="players that command as seldom without looking away were put beside them; they are not judged.",
)
