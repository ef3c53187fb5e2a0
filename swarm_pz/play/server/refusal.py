"""What a client asked for and is not done."""

from __future__ import annotations

from swarm_pz.errors import SwarmError
from swarm_pz.play import protocol


class RefusedError(SwarmError, ValueError):
    """What a client asked for is not done.

    Attributes
    ----------
    code : str
        One of those of the protocol's `Refused`.
    recording : str or None
        The recorded game that there is instead.
    """

    def __init__(self, code: protocol.Reason, reason: str, recording: str | None = None) -> None:
        super().__init__(reason)
        self.code, self.recording = code, recording
