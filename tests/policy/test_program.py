"""Programs play as policies do, and those that misbehave forfeit by name, without leaving a process."""

import gc
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import ForfeitError, PolicyError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policy import Program, allow_files, load, program
from swarm_pz.spaces.observation import observation_space

BOTS = Path(__file__).parents[2] / "examples" / "bots"
SHORT = GameConfig(drones_per_team=2, time_limit=3.0)
GREET = (
    'import json, os, sys, time\nprint(json.dumps({"swarm_pz": 1, "observation": {"kind": "entities"}}), flush=True)\n'
)
READ = "for line in sys.stdin:\n    told = json.loads(line)\n    if 'see' not in told: continue\n    "
ANSWER = "print(json.dumps({'turn': told['turn'], 'density': [[0.5] * 10] * 10}), flush=True)\n"
LATE = {
    "is silent": ("import time\ntime.sleep(600)", "within 0.5 s"),
    "leaves a child": (GREET + "if os.fork() == 0:\n    tell()\n    time.sleep(600)\n", "within 0.5 s"),
    "reads nothing, of more than a pipe holds": (GREET.replace('"kind": "entities"', '"grid": 50') + "time.sleep(600)",
        "within 0.5 s"),
}  # fmt: skip
WRONG = {
    "floods": ("while True: print('{}', flush=True)", "swarm_pz"),
    "writes a huge line": ("import sys\nwhile True: sys.stdout.write('x' * 1000)", "bytes"),
    "answers very deep JSON": (GREET + READ + "print('[' * 100000, flush=True)", "JSON object"),
    "ends at once": ("", "ended with status 0"),
    "ends in a game": (GREET + READ + "sys.exit('out of ideas')", "status 1; it wrote: out of ideas"),
    "ends by a signal": (GREET + READ + "os.kill(os.getpid(), 11)", "SIGSEGV"),
    "closes its output": (GREET + "os.close(1)\ntime.sleep(600)", "closed its output"),
    "fills its errors": (GREET + READ + "\n    while True: sys.stderr.write('x' * 999 + '\\n')", "within 0.5 s"),
    "fills the memory": (GREET + READ + "b = bytearray(2**32); " + ANSWER, "MemoryError"),
}


class NoPipe:
    """A program that is not started, and answers all with the same."""

    answer, is_over = {"swarm_pz": 1, "turn": 0}, False

    def __init__(self, *_):
        pass

    def send(self, message):
        pass

    def receive(self, what):
        return self.answer

    def fault(self, what):
        return ForfeitError(what)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        ({"density": [[float("nan")] * 10] * 10}, "no density"),
        ({"density": 0.5}, "no density"),
        ({"density": [["0.5"] * 10] * 10}, "expected numbers"),
        ({"density": [[True] * 10] * 10}, "expected numbers"),
        ({"turn": 99}, '"turn": 0'),
        ({"swarm_pz": True}, '"swarm_pz": 1'),
        ({"observation": {"kind": "minds"}}, "observation.kind"),
    ],
)
def test_an_answer_that_breaks_the_protocol_forfeits(answer, message, monkeypatch):
    monkeypatch.setattr(program, "Pipe", NoPipe)
    monkeypatch.setattr(program, "_FAILED", {})
    monkeypatch.setattr(NoPipe, "answer", NoPipe.answer | answer)

    def play(player, rows):
        player.reset([0], rows)
        player.act(np.zeros((1, 9, 50, 50), np.uint8), rows)

    with pytest.raises(ForfeitError, match=message):
        play(Program(SHORT, "python3 bot.py"), np.zeros(1, np.int64))


TELL = "import os\ndef tell(): open(os.environ['PIDS'], 'a').write(f'{os.getpid()}\\n')\ntell()\n"


@pytest.fixture
def bad(tmp_path, monkeypatch):
    """Yield a function that writes a Python program and returns its name, and one that returns its process ids."""
    file, pids, started = tmp_path / "bot.py", tmp_path / "pids", []
    pids.touch()

    class Popen(subprocess.Popen):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            started.append(self.pid)

    def make(text):
        file.write_text(TELL + text)
        name = f"exec:PIDS={pids} {sys.executable} {file}"
        allow_files([name])
        return name

    monkeypatch.setattr(program.subprocess, "Popen", Popen)
    yield make, lambda: [*started, *map(int, pids.read_text().split())]
    program._FAILED.clear()


def is_gone(process):
    """Return whether a process has ended; a zombie has, too."""
    status = Path(f"/proc/{process}/stat")
    return not status.exists() or status.read_text().rsplit(")", 1)[1].split()[0] == "Z"


@pytest.mark.parametrize("what", [*LATE, *WRONG])
def test_a_program_that_misbehaves_forfeits_by_name_and_leaves_no_process(what, bad, monkeypatch):
    make, processes = bad
    text, message = {**LATE, **WRONG}[what]
    if "0.5 s" in message:
        monkeypatch.setattr(program, "SECONDS", 0.5)
    name = make(text)
    result = play_match(name, "noise", games=2, config=SHORT)
    assert [game.outcome for game in result.games] == ["loss", "loss"]
    assert all(game.forfeit.startswith(name) for game in result.forfeits) and len(result.forfeits) == 2
    assert "0.5 s" in message or all(message in game.forfeit for game in result.forfeits), result.forfeits[0].forfeit
    gc.collect()
    assert processes() and all(map(is_gone, processes()))


def test_a_program_ends_with_the_process_that_plays_even_where_that_is_killed(bad):
    make, processes = bad
    line = make("print('{\"swarm_pz\": 1}', flush=True)\nimport time\ntime.sleep(600)").removeprefix("exec:")
    text = "import os, sys; from swarm_pz.config import GameConfig; from swarm_pz.policy import Program\n"
    text += "player = Program(GameConfig(), sys.argv[1]); os.kill(os.getpid(), 9)"
    subprocess.run([sys.executable, "-c", text, line], check=False)  # noqa: S603
    end = time.monotonic() + 30.0
    while not (len(processes()) == 2 and is_gone(processes()[1])):
        assert time.monotonic() < end, processes()
        time.sleep(0.05)


def compiled(bot, tmp_path):
    """Return the line that runs a starter, or None if its compiler or interpreter is missing."""
    source, made = str(BOTS / bot), str(tmp_path / "bot")
    needs = {"ring.cpp": "g++", "ring.rs": "rustc", "ring.py": sys.executable, "ring.js": "node"}[bot]
    # One can be installed but not set up, such as rustup's.
    if not shutil.which(needs) or subprocess.run([needs, "--version"], capture_output=True).returncode:  # noqa: S603
        return None
    if needs not in ("g++", "rustc"):
        return f"{needs} {source}"
    subprocess.run([needs, "-O", "-o", made, source], check=True)  # noqa: S603
    return made


@pytest.mark.parametrize("bot", sorted(path.name for path in BOTS.iterdir()))
def test_starters_answer_alike(bot, tmp_path):
    line = compiled(bot, tmp_path)
    if line is None:
        pytest.skip("its compiler is not there")
    policy, rows = Program(GameConfig(), line), np.arange(2)
    policy.reset([1, 2], rows)
    images = np.zeros((2, 1, 10, 10), np.uint8)
    images[0, 0, 1, 2] = images[0, 0, 3, 2] = 64
    x, y = np.meshgrid(*[(np.arange(10) + 0.5) / 10] * 2)
    for place, (column, row) in enumerate([(0.25, 0.25), (0.5, 0.5)]):
        expected = np.exp(-(((np.hypot(x - column, y - row) - 0.25) / 0.1) ** 2))
        assert np.abs(policy.act(images, rows)[place] - expected).max() < 1e-5
    assert len((BOTS / bot).read_text().splitlines()) < 120


def test_games_are_the_same_again_and_seeds_and_rules_are_told(bad):
    text = (
        "import json, random, sys\n"
        "for line in sys.stdin:\n"
        "    told = json.loads(line)\n"
        "    if 'swarm_pz' in told:\n"
        "        assert told['rules']['drones_per_team'] == [2, 2] and told['grids'][-1] == 50, told\n"
        "        print(json.dumps({'swarm_pz': 1, 'observation': {'grid': 5}}), flush=True)\n"
        "    elif 'begin' in told:\n"
        "        random.seed(told['seed'])\n"
        "    else:\n"
        "        assert len(told['see']) == 9 and len(told['see'][0]) == 5\n"
        "        density = [[random.random() for _ in range(10)] for _ in range(10)]\n"
        "        print(json.dumps({'turn': told['turn'], 'density': density}), flush=True)\n"
    )
    name = bad[0](text)
    first, second = (play_match(name, "noise", games=2, seed=3, config=SHORT) for _ in range(2))
    assert not first.forfeits and first.summary()["unique_games"] == 2
    assert [game.fingerprint for game in first.games] == [game.fingerprint for game in second.games]


def test_a_program_that_was_mended_plays_in_the_same_process(bad):
    name = bad[0]("")
    assert len(play_match(name, "noise", games=2, config=SHORT).forfeits) == 2
    assert bad[0](GREET + READ + ANSWER) == name
    assert not play_match(name, "noise", games=2, config=SHORT).forfeits


def test_a_program_that_ended_is_started_again_for_the_next_game(bad):
    """The program ends once; then the same object plays each game again alone."""
    text = GREET + READ + "\n    if not os.path.exists('ended'): open('ended', 'w').close(); sys.exit()\n    " + ANSWER
    player = Program(SHORT, bad[0](text).removeprefix("exec:"))
    assert not play_match(player, "noise", games=2, config=SHORT).forfeits


def test_a_program_has_a_time_for_each_game_which_grows_with_its_commands(bad):
    """Each answer moves the clock: by 7 s in game 0, by 0.05 s in game 1."""
    now = iter(np.cumsum([0.0, 7.0, 0.05] * 4))
    line = bad[0](GREET + READ + ANSWER).removeprefix("exec:")
    player, rows = Program(SHORT, line, clock=lambda: float(next(now))), np.arange(2)
    player.reset([0, 1], rows)
    space = observation_space(SHORT, ObservationConfig(kind="entities"))
    observations = {name: np.zeros((2, *part.shape), part.dtype) for name, part in space.items()}
    for _ in range(2):
        player.act(observations, rows)
    with pytest.raises(ForfeitError, match=r"at most 20 s in a game and 0\.1 s more .* its time was over at turn 4"):
        player.act(observations, rows)


def test_a_digest_covers_what_lies_beside_a_program(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "bots" / "mine"
    (folder / "parts").mkdir(parents=True)
    for file in ("main.py", "parts/helper.py", "weights.bin"):
        (folder / file).touch()
    for file in ("bot.py", "near.py"):
        (tmp_path / file).touch()

    def digests():
        lines = (("python3 bots/mine/main.py", None), ("python3 main.py", folder), ("python3 bot.py", None))
        return [Program(SHORT, line, place).digest for line, place in lines]

    monkeypatch.setattr(program, "Pipe", NoPipe)
    before = digests()
    for file, changed in (
        ("bots/mine/parts/helper.py", [True, True, False]),
        ("bots/mine/weights.bin", [True, True, False]),
        ("bots/mine/__pycache__/main.pyc", [False] * 3),
        ("bots/mine/entry.toml", [False] * 3),
        ("bot.py", [False, False, True]),
        ("near.py", [False] * 3),
    ):
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_text(file)
        after = digests()
        assert [one != other for one, other in zip(before, after, strict=True)] == changed, file
        before = after
    monkeypatch.setattr(program, "_MOST_FILES", 2)
    with pytest.raises(PolicyError, match="at most 2 files"):
        digests()


def test_it_inherits_only_what_is_named(monkeypatch):
    monkeypatch.setenv("SECRET", "1")
    code = "import json, os; print(json.dumps({'env': sorted(os.environ)}), flush=True)"
    policy = Program(SHORT, f"GIVEN=1 {sys.executable} -c {json.dumps(code)}")
    with pytest.raises(PolicyError, match=r'got .*"GIVEN"') as error:
        policy.reset([0], np.zeros(1, np.int64))
    assert "SECRET" not in str(error.value) and "PATH" in str(error.value)
    program._FAILED.clear()


def test_names_of_programs_are_taken_from_the_command_line_alone(monkeypatch):
    monkeypatch.setenv("SWARM_PZ_FILES", "")
    with pytest.raises(PolicyError, match="command line alone"):
        load("exec:./bot", SHORT)
    allow_files(["exec:./no_such_bot", "exec:"])
    for name, message in (("exec:./no_such_bot", "no program './no_such_bot'"), ("exec:", "expected a program")):
        with pytest.raises(PolicyError, match=message):
            load(name, SHORT)
    assert os.environ["SWARM_PZ_FILES"]
