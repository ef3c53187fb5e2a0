"""Which web pages may connect to a rosbridge: browsers let every page open a WebSocket to this machine."""

from __future__ import annotations

import re
from collections.abc import Sequence

from websockets import Origin

from swarm_pz.errors import CommandError
from swarm_pz.play.server.serve import names_of

Origins = Sequence[Origin | re.Pattern[str] | None]
"""What a WebSocket server takes as origins; None is programs, which send none."""


def origins_of(host: str, others: Sequence[str] = ()) -> Origins:
    """Return who may connect to a server: programs, pages of this machine at any port, and pages of other addresses.

    Parameters
    ----------
    host : str
        Where the server listens.
    others : sequence of str
        Such as https://lab.example, or file:// for programs that are pages themselves.

    Raises
    ------
    CommandError
        If one of these is no address of a page, or there is no such host.
    """
    for other in others:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9+.-]*://[^/\s]*/?", other):
            raise CommandError(
                "--ros-origin takes the address of a page without its path, such as https://lab.example or file://, "
                f"got {other!r}"
            )
    names = "|".join(re.escape(name.removesuffix(":0")) for name in names_of(host, 0))
    home = re.compile(f"https?://({names})(:[0-9]+)?", re.IGNORECASE)
    return [None, home, *(Origin(re.sub("(?<=[^/])/$", "", other.lower())) for other in others)]


AT_HOME = origins_of("127.0.0.1")
"""Programs, and pages that this machine serves itself."""
