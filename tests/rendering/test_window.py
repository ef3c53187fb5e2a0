from __future__ import annotations

import numpy as np
import pygame
import pytest

from swarm_pz.errors import RenderError
from swarm_pz.rendering.window import Window


def test_a_window_shows_the_picture_upright_under_its_title_keeps_its_rate_and_closes(monkeypatch):
    calls = []

    class Clock:
        def tick(self, rate):
            calls.append(rate)

    monkeypatch.setattr("pygame.time.Clock", Clock)
    monkeypatch.setattr("pygame.event.pump", lambda: calls.append("answered"))
    window, picture = Window("a title", 50), np.arange(6 * 8 * 3, dtype=np.uint8).reshape(6, 8, 3)
    for shown in (picture, picture[::-1]):
        window.show(shown)
        on_screen = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
        np.testing.assert_array_equal(on_screen, shown)
    assert pygame.display.get_caption()[0] == "a title"
    window.refresh()
    assert calls == ["answered", 50] * 2 + ["answered"]
    window.close()
    assert not pygame.display.get_init()


def test_without_a_display_human_says_so_and_does_not_hang(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(RenderError, match="needs a display"):
        Window("a title", 50)
