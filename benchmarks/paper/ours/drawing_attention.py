"""What it costs to draw: while a drawing is made, the last command stays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.figure import Figure, Finding, Setting, above, asked, estimate
from swarm_pz.config import ObservationConfig
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


def tally(seconds: int, opponent: str, setting: Setting, looks: Look = "begin") -> Array:
    """Play, and return of each game (n, 3) the drones lost, the seconds played, and the share of drones in the end."""
    config = setting.config
    tactic = load(TACTIC, config)
    if not isinstance(tactic, Policy):
        raise CommandError(f"expected a policy that sees what its side may see, got {TACTIC!r}")
    drawer = Drawer(tactic, seconds, looks)
    rollout = Rollout(drawer, opponent, setting.games(GAMES), seed=setting.seed, config=config)
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


def measure(setting: Setting) -> Finding:
    """Play with drawings that take longer and longer, from the same starts; and as seldom, without looking away."""
    judged, games = DRAWING.index(JUDGED), {}
    for opponent in OPPONENTS:
        at_once = tally(0, opponent, setting)
        for looks in LOOKS:
            games[opponent, looks] = [at_once, *(tally(seconds, opponent, setting, looks) for seconds in DRAWING[1:])]
    parts = []
    for opponent in OPPONENTS:
        late, prompt = games[opponent, "begin"], games[opponent, "send"]
        drawn, away = (
            estimate(np.stack(two, axis=1), more_lost)
            for two in ((late[0], late[judged]), (prompt[judged], late[judged]))
        )
        parts += [
            asked(
                f"more lost a minute by {JUDGED} s of drawing, against {opponent}, above 0",
                drawn,
                above(0.0),
                ours=True,
            ),
            asked(f"of these by looking away, against {opponent}", away, ours=True),
        ]
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
        parts=parts,
        method=f"bootstrap over {setting.many(GAMES)} starts, which all share",
        configs={"rules": setting.config},
        seeds=[setting.seed],
        series=found,
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw what is lost, and what is left, by the seconds that a drawing takes."""
    left, right = style.panels(figure, 2, (1, 2))
    for number, (opponent, by_look) in enumerate(series.items()):
        for looks, fmt, face, text in zip(
            LOOKS, ("o-", "s:"), (style.SERIES[number], "white"), ("draws so long", "commands as seldom"), strict=True
        ):
            for axes, name, factor in ((left, "lost", 1), (right, "share", 100)):
                value, low, high = factor * np.transpose(by_look[looks][name])
                look: dict[str, Any] = {"fmt": fmt, "color": style.SERIES[number], "markerfacecolor": face}
                style.whisker(axes, np.array(DRAWING), value, low, high, label=f"{text}, against {opponent}", **look)
    left.set(ylabel="drones lost a minute", xlabel="seconds between two commands")
    left.set_ylim(bottom=0)
    style.mark(right, 50, "even")
    right.set(ylabel=f"own drones after {SECONDS} s (%)", xlabel="seconds between two commands", ylim=(0, 100))
    style.legend_below(figure, left, (1, 2))


FIGURE = Figure(
    name="drawing_attention",
    claim="Drawing takes time, in which the last command stays and drones are lost.",
    note=f"The paper says that drawing takes a player's eyes off the game, and counts no drones. `{TACTIC}` looks, "
    "draws for some seconds, and then sends; 0 s is a command at once, every second. This is the price of time, not of "
    "attention: for people, `swarm-pz study tables` counts `lost_while_drawing`.",
    measure=measure,
    draw=draw,
    heights=(4.4, 2.4),
    seconds=16,
    revised="players that command as seldom without looking away were put beside them; they are not judged.",
    presets=("paper",),
)
