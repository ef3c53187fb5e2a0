"""A window on the screen that shows pictures at a steady rate."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import RenderError, require_extra


class Window:
    """A window, opened by the first picture, at most `rate` pictures a second; raises RenderError without a display."""

    def __init__(self, title: str, rate: int) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        self._pygame = require_extra("pygame", "render")
        advice = (
            "render_mode='human' needs a display and found none: use 'rgb_array' or 'ansi', or set "
            "SDL_VIDEODRIVER=dummy to run without showing anything"
        )
        has_display = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"))
        if sys.platform.startswith("linux") and not has_display:
            raise RenderError(advice)
        try:
            self._pygame.display.init()
        except self._pygame.error as error:
            raise RenderError(f"{advice} ({error})") from error
        self._title, self._rate, self._clock = title, rate, self._pygame.time.Clock()
        self._surface: Any = None

    def show(self, picture: NDArray[np.uint8]) -> None:
        """Show a picture (height, width, 3), no sooner than the rate allows."""
        height, width = picture.shape[:2]
        if self._surface is None:
            self._surface = self._pygame.display.set_mode((width, height))
            self._pygame.display.set_caption(self._title)
        frame = self._pygame.surfarray.make_surface(picture.swapaxes(0, 1))
        self._surface.blit(frame, (0, 0))
        self._pygame.display.flip()
        self.refresh()
        self._clock.tick(self._rate)

    def refresh(self) -> None:
        """Handle events, so that the desktop does not call the window hung."""
        self._pygame.event.pump()

    def close(self) -> None:
        """Close the window."""
        self._pygame.display.quit()
