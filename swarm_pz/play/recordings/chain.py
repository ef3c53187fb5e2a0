"""Lines that hold together: each ends with a hash of its own content and of the hash before it.

A line that is changed, cut out, doubled or moved breaks the chain there. Somebody who makes all later hashes anew can
mend it, so note the last link elsewhere when a game ends: it vouches for the whole file.
"""

from __future__ import annotations

import hashlib
import re

from swarm_pz.errors import RecordingError

START = ""
"""What the first line follows."""
_DIGITS = 16
_END = re.compile(rb',"chain":"([0-9a-f]{%d})"\}' % _DIGITS)
_END_BYTES = len(b',"chain":"') + _DIGITS + len(b'"}')


def link_of(content: bytes, before: str) -> str:
    """Return a line's link: the first 16 hexadecimal digits of the SHA-256 of the link before it and its content."""
    return hashlib.sha256(before.encode() + content).hexdigest()[:_DIGITS]


def chained(content: bytes, before: str) -> tuple[bytes, str]:
    """Return a line, a JSON object with content, with its link as its last field; and the link."""
    link = link_of(content, before)
    return content[:-1] + f',"chain":"{link}"}}'.encode(), link


def followed(line: bytes, before: str, where: str) -> str:
    """Return a line's link, or raise RecordingError if the line does not follow the one whose link came before."""
    end = _END.fullmatch(line[-_END_BYTES:])
    link = end[1].decode() if end is not None else None
    if link_of(line[:-_END_BYTES] + b"}", before) != link:
        raise RecordingError(
            f"{where} does not follow the line before it: one of them was changed, or lines were cut out, doubled or "
            "moved"
        )
    return link
