"""Crazyflies of Crazyflow fly a game of 5 against 5 through the rosbridge, compared with games of point masses.

python -m venv ENV && ENV/bin/pip install crazyflow      # a separate environment: crazyflow needs other versions
python examples/crazyflow_game.py --python ENV/bin/python

The robots' measured positions decide captures. The program prints tracking error and delay, writes a film, and compares
captures and ergodic metrics with 20 games of point masses under the same commands.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from swarm_pz import GameConfig, Simulator
from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.play.protocol import CapturedMessage
from swarm_pz.play.recordings.recording import Recording

LAB = Path(__file__).resolve().with_name("crazyflow_lab.py")
DRONES, COUNTDOWN_S = 5, 6
GAMES, MODES, WINDOW_S = 20, 8, 10
"""Games of point masses; modes a side of an ergodic metric, and seconds of its window."""


def fly(python: str, opponent: str, seconds: float, out: Path) -> Path:
    """Let robots fly a game, and return its recording."""
    numbers = {"drones-per-team": DRONES, "time-limit": seconds}
    rules = [text for name, value in numbers.items() for text in (f"--game.{name}", str(value))]
    play = [sys.executable, "-u", "-m", "swarm_pz", "play", "--poses", "--port", "0", "--rosbridge", "0"]
    play += ["--ros-opponent", opponent, "--countdown", str(COUNTDOWN_S), "--out", str(out), *rules]
    log = out / "server.log"
    with log.open("w") as printed, subprocess.Popen(play, stdout=printed) as server:
        while not (match := re.search(r"rosbridge is at (\S+)", log.read_text())):
            time.sleep(0.2)
        options = [f"--address={match[1]}", f"--robots={2 * DRONES}", "--out=lab.npz"]
        try:
            subprocess.run([str(Path(python).absolute()), str(LAB), *options], check=True, cwd=out)
        finally:
            server.terminate()
    return max(out.glob("*.jsonl"))


def report_tracking(path: Path) -> None:
    """Print how well the robots follow their setpoints, and how late the game shows them."""
    with np.load(path) as data:
        seconds, flown, setpoints = (data[name] for name in ("seconds", "flown", "asked"))
        shown_s, ends, shown = data["shown_seconds"], np.cumsum(data["shown_sizes"]), data["shown"]
    error = np.linalg.norm(flown[..., :2] - setpoints[..., :2], axis=-1)
    print(f"tracking error, horizontally: mean {error.mean():.3f} m, 95 % below {np.quantile(error, 0.95):.3f} m")
    away = np.linalg.norm(flown[:, :, None, :2] - flown[:, None, :, :2], axis=-1) + 10.0 * np.eye(flown.shape[1])
    print(f"least distance, horizontally: {away.min():.2f} m between robots")
    speed = np.linalg.norm(flown[..., 3:5], axis=-1)
    print(f"speed: mean {speed.mean():.2f} m/s, at most {speed.max():.2f} m/s")
    step = float(np.median(np.diff(seconds)))
    lags = range(40)
    behind = [np.linalg.norm(flown[n:, :, :2] - setpoints[: len(setpoints) - n, :, :2], axis=-1).mean() for n in lags]
    print(f"delay: robots are nearest to the setpoint of {1000 * step * int(np.argmin(behind)):.0f} ms before")
    corner, scale = np.array([-1.5, -1.5]), 3.0
    ages = np.arange(0.0, 0.5, step)
    misses = np.zeros(len(ages))
    for now, end, start in zip(shown_s[::5], ends[::5], np.r_[0, ends[:-1]][::5], strict=True):
        places = corner + scale * shown[start:end]
        for n, age in enumerate(ages):
            then = flown[min(np.searchsorted(seconds, now - age), len(flown) - 1), :, :2]
            if len(places):
                misses[n] += np.linalg.norm(places[:, None] - then[None], axis=-1).min(axis=1).mean()
    print(f"delay: the game shows robots where they were {1000 * ages[misses.argmin()]:.0f} ms before")


def metric(places: np.ndarray, teams: np.ndarray, team: int, target: np.ndarray) -> float:
    """Return a team's mean ergodic metric over all windows of `WINDOW_S` of a game with places (T, N, 2)."""
    k = np.arange(MODES)
    weights = (1.0 + k[:, None] ** 2 + k[None, :] ** 2) ** -1.5 * np.where(k, 2, 1)[:, None] * np.where(k, 2, 1)
    cells = (np.arange(len(target)) + 0.5) / len(target)
    wanted = np.einsum("yx,ix,jy->ij", target / target.sum(), *2 * [np.cos(np.pi * np.outer(k, cells))])
    own = (teams == team)[..., None]
    waves = np.cos(np.pi * places[..., None] * k) * own[..., None]
    window, metrics = WINDOW_S * TICKS_PER_SECOND, []
    for end in range(window, len(places) + 1, TICKS_PER_SECOND):
        part = slice(end - window, end)
        if own[part].any():
            flown = np.einsum("tni,tnj->ij", waves[part, :, 0], waves[part, :, 1]) / own[part].sum()
            metrics.append((weights * (flown - wanted) ** 2).sum())
    return float(np.mean(metrics)) if metrics else float("nan")


def read(recording: Recording) -> tuple[np.ndarray, np.ndarray, list[tuple[int, int, np.ndarray]], int]:
    """Return a recording's places (T, N, 2), teams (T, N), commands in force and captures."""
    places = np.array([*recording.poses.values()])[..., :2]
    teams = np.repeat([0, 1], DRONES) * np.ones((len(places), 1), int)
    captured = recording.of(CapturedMessage)
    for one in captured:
        teams[one.tick :, one.drone] = one.team
    commands = [(tick, command.team, command.values) for tick, command in recording.in_force()]
    return places, teams, commands, len(captured)


def simulate(
    game: GameConfig, seed: int, commands: list, teams: np.ndarray | None, ticks: int
) -> tuple[np.ndarray, int]:
    """Return places of point masses that follow the same commands, and their captures.

    If `teams` (T, N) is given, drones are in these teams, and captures are off.
    """
    if teams is not None:
        game = game.replace(capture=game.capture.replace(enabled=False))
    simulator, places = Simulator(game), []
    simulator.reset([seed])
    for tick in range(ticks):
        for when, team, density in commands:
            if when == tick:
                simulator.command(team, density[None])
        if teams is not None:
            turned = simulator.games.teams[0] != teams[tick]
            simulator.games.teams[0] = teams[tick]
            simulator.games.memory[0][:, :, np.flatnonzero(turned)] = 0.0  # as captures do
            simulator.games.memory_weight[0, turned] = 0.0
        simulator.advance(1)
        places.append(simulator.positions[0].copy())
    return np.array(places), int(simulator.games.captures.sum())


def main() -> None:
    """Fly, compare and film."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", required=True, help="Python of an environment with crazyflow")
    parser.add_argument("--opponent", default="uniform")
    parser.add_argument("--seconds", type=float, default=60.0, help="seconds of game")
    parser.add_argument("--out", type=Path, default=Path("runs/crazyflow"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    path = fly(arguments.python, arguments.opponent, arguments.seconds, arguments.out)
    replay = [sys.executable, "-m", "swarm_pz", "replay", str(path)]
    subprocess.run([*replay, "--verify"], check=True)
    report_tracking(arguments.out / "lab.npz")
    recording = Recording.read(path)
    places, teams, commands, captures = read(recording)
    game, seed = recording.config.game, recording.header.seed
    seeds = range(seed, seed + GAMES)
    counts = [simulate(game, seed, commands, None, len(places))[1] for seed in seeds]
    print(f"captures: {captures} flown; {np.median(counts):.0f} ({min(counts)} to {max(counts)}) of point masses")
    others = [simulate(game, seed, commands, teams, len(places))[0] for seed in seeds]
    for team, name in enumerate(TEAM_NAMES):
        target = next(density for _, own, density in commands[::-1] if own == team)
        values = [metric(other, teams, team, target) for other in others]
        print(
            f"ergodic metric of {name}: {metric(places, teams, team, target):.4f} flown; {np.mean(values):.4f} "
            f"({min(values):.4f} to {max(values):.4f}) of point masses in the same teams"
        )
    subprocess.run([*replay, "--film", str(arguments.out / "game.mp4")], check=True)


if __name__ == "__main__":
    main()
