"""Generated opponents: each game has its own, which does not depend on other games."""

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.policies.generated import TEST, TRAINING, generated
from swarm_pz.policy import registered

GAMES = 40
ROWS = np.arange(GAMES)


def played(kind, rows, seconds=12):
    """Return the densities (seconds, n, A, A) of a kind in games of the seeds `rows`, with moving drones."""
    policy = kind(GameConfig())
    policy.reset(rows.tolist(), rows)
    grid, channels = policy.observation.grid, policy.observation.channels
    answers = []
    for second in range(seconds):
        images = np.zeros((len(rows), len(channels), grid, grid), np.uint8)
        images[np.arange(len(rows)), :, (rows + second) % grid, (3 * rows) % grid] = 64
        answers.append(policy.act(images, rows))
    return np.stack(answers)


@pytest.mark.parametrize("kind", [*TRAINING, generated, *TEST], ids=lambda kind: kind.__name__)
def test_a_games_opponent_is_its_own_and_depends_on_no_other_game(kind):
    answers = played(kind, ROWS)
    assert np.isfinite(answers).all() and answers.min() >= 0.0 and (answers.max(axis=(2, 3)) == 1.0).all()
    np.testing.assert_array_equal(played(kind, ROWS[7:8]), answers[:, 7:8])
    assert len(np.unique(answers.reshape(len(answers), GAMES, -1), axis=1)[0]) > GAMES // 2


def test_images_to_test_with_are_far_from_those_to_train_with():
    """Fewer than 5 % lie within total variation 0.1 of one of 6,000 training images, so the moves that they belong to
    differ, too."""
    rows = np.arange(100)

    def images(kind, seconds):
        shown = played(kind, rows, seconds)[:: max(seconds // 12, 1)].reshape(-1, 100)
        return shown / shown.sum(axis=1, keepdims=True)

    trained = np.concatenate([images(kind, 36) for kind in TRAINING])
    for kind in TEST:
        nearest = [0.5 * np.abs(trained - image).sum(axis=1).min() for image in images(kind, 24)[::12]]
        assert np.mean(np.array(nearest) < 0.1) < 0.05, kind.__name__


def test_kinds_to_test_with_are_no_kinds_to_train_with_and_have_no_names():
    assert not set(TEST) & set(TRAINING)
    assert not {kind.__name__ for kind in TEST} & set(registered())
