from __future__ import annotations

import numpy as np
import pygame
import pytest

from swarm_pz.rendering.window import Window


@pytest.fixture
def window():
    window = Window("a title", 50)
    yield window
    window.close()


def test_a_window_shows_the_picture_upright_under_its_title(window):
    picture = np.arange(6 * 8 * 3, dtype=np.uint8).reshape(6, 8, 3)
    for shown in (picture, picture[::-1]):
        window.show(shown)
        on_screen = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
        np.testing.assert_array_equal(on_screen, shown)
    assert pygame.display.get_caption()[0] == "a title"


def test_a_window_keeps_its_rate_answers_the_desktop_and_closes(window, monkeypatch):
    asked = []

    class Clock:
        def tick(self, rate):
            asked.append(rate)

    monkeypatch.setattr("pygame.time.Clock", Clock)
    monkeypatch.setattr("pygame.event.pump", lambda: asked.append("answered"))
    other = Window("other", 50)
    other.show(np.zeros((4, 4, 3), np.uint8))
    other.refresh()
    assert asked == ["answered", 50, "answered"]
    other.close()
    assert not pygame.display.get_init()
