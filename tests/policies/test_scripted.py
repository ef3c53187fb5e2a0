from __future__ import annotations

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import PolicyError
from swarm_pz.figures import ensemble_tactic
from swarm_pz.policies import held_out
from swarm_pz.policies.scripted import SCRIPTS, View, tactic
from swarm_pz.policy import Policy

NAMES = sorted(script.__name__ for script in SCRIPTS)
HELD_OUT = sorted({trial.opponent for trial in held_out.SUITE} - set(SCRIPTS), key=lambda made: made.__name__)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("cells", [5, 10])
def test_every_policy_answers_every_board(name, cells):
    config = GameConfig(drones_per_team=(2, 5), command_cells=cells)
    batch = BatchEnv(config, 6)
    batch.reset(range(6))
    policy = policies.load(name, config)
    assert isinstance(policy, Policy)
    policy.reset(list(range(6)), np.arange(6))
    for _ in range(15):
        rows = np.flatnonzero(batch.running)
        commands = np.ones((6, 2, cells, cells))
        answer = batch.ask(policy, np.ones_like(rows), rows)
        assert answer.max() == pytest.approx(1.0)
        commands[rows, 1] = answer
        batch.step(commands)


def boards(generator, count, shape):
    """Draw images: a few drones a board, none on the first, and now and then any brightness anywhere."""
    images = 64 * generator.integers(1, 4, (count, *shape)) * (generator.random((count, *shape)) < 0.03)
    if generator.random() < 0.3:
        images = generator.integers(0, 256, images.shape)
    images[0] = 0
    return images.astype(np.uint8)


@pytest.mark.parametrize("make", [*SCRIPTS, *HELD_OUT, ensemble_tactic.Ensemble], ids=lambda make: make.__name__)
def test_answers_do_not_depend_on_the_batch_bit_for_bit(make):
    generator = np.random.default_rng(0)
    for count in (2, 3, 8, 70):
        together, alone = make(GameConfig()), make(GameConfig())
        rows = np.arange(count)
        shape = (len(together.observation.channels), together.observation.grid, together.observation.grid)
        for policy in (together, alone):
            policy.reset(rows.tolist(), rows)
        for _ in range(4):
            images = boards(generator, count, shape)
            answers = together.act(images, rows)
            for row in rows:
                one = alone.act(images[row : row + 1], rows[row : row + 1])[0]
                np.testing.assert_array_equal(answers[row], one, err_msg=f"game {row} of {count}")


def test_the_opponents_mean_position_is_theirs_and_the_centre_if_there_are_none():
    images = np.zeros((2, 1, 25, 25), np.uint8)
    images[1, 0, 3, 7], images[1, 0, 4, 7] = 64, 192
    view = View(images, ("opposing_positions",), 10, np.zeros(2, int), [], np.zeros((2, 0)))
    np.testing.assert_allclose(view.mean_position("opposing"), [[0.5, 0.5], [7.5 / 25, 4.25 / 25]], rtol=1e-15)


def test_unknown_names_list_the_nearest():
    with pytest.raises(
        PolicyError,
        match=r"no policy 'unifrom', and no such folder; did you mean 'uniform'\? Known: .*wavefront",
    ):
        policies.load("unifrom")


def test_all_scripts_have_a_name():
    assert set(NAMES) <= set(policies.names())


def test_ring_surrounds_the_opponents():
    batch = BatchEnv()
    positions = np.concatenate([np.full((10, 2), 0.9), np.full((10, 2), 0.5)])
    batch.reset([0], scenario={"positions": positions})
    ring = policies.load("ring")
    ring.reset([0], np.zeros(1, int))
    density = ring.act(batch.observe(ring.observation, 0), np.zeros(1, int))[0]
    assert density[4, 4] < 0.1
    assert density[5, 7] > 0.8
    assert density[0, 0] < 0.01


def first_answer(name, team, place):
    """Return a script's first answer where the opponents are at a place, and its own drones at the mirrored one."""
    batch, only = BatchEnv(), np.zeros(1, int)
    places = [np.subtract(1, place), place]
    positions = np.repeat(places if team == 0 else places[::-1], 10, axis=0)
    batch.reset([0], scenario={"positions": positions})
    policy = policies.load(name)
    policy.reset([0], only)
    return batch.ask(policy, np.full(1, team), only)[0]


@pytest.mark.parametrize("team", [0, 1])
@pytest.mark.parametrize(("x", "y"), [(0.86, 0.26), (0.26, 0.86)])
def test_scripts_know_where_the_opponents_are(x, y, team):
    answers = {name: first_answer(name, team, (x, y)) for name in ("chase", "ring", "lasso", "evade", "wavefront")}
    row, column = int(10 * y), int(10 * x)
    assert answers["chase"].argmax() == 10 * row + column
    assert answers["ring"][row, column] < 0.01 < answers["ring"].mean()
    mass = answers["lasso"] / answers["lasso"].sum()
    cells = (np.arange(10) + 0.5) / 10
    leans = np.array([mass.sum(axis=0) @ cells, mass.sum(axis=1) @ cells]) - 0.5
    np.testing.assert_allclose(leans, 0.3 * (np.array([x, y]) - 0.5), atol=0.05)
    far_row, far_column = (0 if y > 0.5 else 9), (0 if x > 0.5 else 9)
    assert answers["evade"].argmax() == 10 * far_row + far_column
    wall = answers["wavefront"] if x > 0.5 else answers["wavefront"][:, ::-1]
    assert wall[:, :2].min() > 0.8
    assert wall[:, 4:].max() < 0.01


def test_a_wave_ends_at_the_other_side_and_begins_anew():
    policy, only = policies.load("wavefront"), np.zeros(1, int)
    policy.reset([0], only)
    images = np.zeros((1, 1, 25, 25), np.uint8)
    images[0, 0, 12, 24] = 64
    covered = [(policy.act(images, only)[0] > 0.5).sum() // 10 for _ in range(13)]
    assert covered[:5] == [covered[0]] * 5 and covered == [*sorted(covered[:12]), covered[0]]
    assert covered[0] <= 3 and covered[11] >= 9


def test_a_tactic_that_says_nothing_about_what_it_sees_needs_no_parentheses():
    def halves(view):
        return view.every(np.where(view.x < 0.5, 1.0, 0.0))

    for made in (tactic(halves), tactic()(halves)):
        assert (made.__name__, made.seat) == ("halves", ObservationConfig(grid=10))
        batch, policy, only = BatchEnv(), made(GameConfig()), np.zeros(1, int)
        batch.reset([0])
        policy.reset([0], only)
        assert batch.ask(policy, only, only)[0].tolist() == [[1.0] * 5 + [0.0] * 5] * 10
    with pytest.raises(PolicyError, match=r"as @tactic or @tactic\(sees=..., grid=...\), got \('time_left',\)"):
        tactic(("time_left",))


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (np.ones((10, 10)), r"numbers in \[0, inf\] of shape \(2, 10, 10\), got shape \(10, 10\)"),
        (np.full((2, 10, 10), -1.0), r"got values from -1 to -1"),
        (np.full((2, 10, 10), np.nan), r"got nan at index \(0, 0, 0\)"),
        (None, r"got NoneType None"),
    ],
)
def test_a_tactic_that_returns_nonsense_hears_what_was_expected(returned, message):
    @tactic(sees=("time_left",))
    def lost(view):
        return returned

    policy = lost(GameConfig())
    policy.reset([0, 1], np.arange(2))
    with pytest.raises(PolicyError, match="what tactic 'lost' returns for 2 games must be " + ".*" + f"({message})"):
        policy.act(np.zeros((2, 1, 10, 10), np.uint8), np.arange(2))
