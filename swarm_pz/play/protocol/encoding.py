"""How messages are written and read: the limits, and the schema."""

from __future__ import annotations

import json
import re
from typing import Any, TypeVar

import msgspec

from swarm_pz.errors import ProtocolError
from swarm_pz.play.protocol.client_messages import ClientMessage
from swarm_pz.play.protocol.server_messages import ServerMessage

SUBPROTOCOL = "swarm-pz.play.v2"
"""What clients and tables speak."""
MAX_MESSAGE_BYTES = 65_536
MAX_MESSAGES_PER_SECOND = 20

LARGEST, SMALLEST = 1e22, 1e-300
"""Sizes of numbers other than 0: msgspec reads those further from 1 up to a thousand times as slowly."""
_FAR = re.compile(r"[eE](?:\+?[0-9]{2}|-[0-9]{3})"), re.compile(rb"[eE](?:\+?[0-9]{2}|-[0-9]{3})")
"""What a number has that may be so far from 1, in text and in bytes; words may have it, too."""

T = TypeVar("T")

_client_decoder: msgspec.json.Decoder[ClientMessage] = msgspec.json.Decoder(ClientMessage)
_server_decoder: msgspec.json.Decoder[ServerMessage] = msgspec.json.Decoder(ServerMessage)
_encoder = msgspec.json.Encoder()


def decode_client(text: str | bytes) -> ClientMessage:
    """Read a client's message.

    Raises
    ------
    ProtocolError
        If it is too long or fits none of the messages.
    """
    return _decode(_client_decoder, text)


def decode_server(text: str | bytes) -> ServerMessage:
    """Read a server's message, as `decode_client`."""
    return _decode(_server_decoder, text)


def _decode(decoder: msgspec.json.Decoder[T], text: str | bytes) -> T:
    if len(text) > MAX_MESSAGE_BYTES:
        raise ProtocolError(f"a message may have {MAX_MESSAGE_BYTES} bytes, got {len(text)}")
    try:
        return decode(decoder, text)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ProtocolError(f"not a message of {SUBPROTOCOL}: {error}") from error


def decode(decoder: msgspec.json.Decoder[T], text: str | bytes) -> T:
    """Read JSON that anybody may have written, for about as little time a byte whatever it holds.

    Raises
    ------
    DecodeError
        If it is not what the decoder reads, or a number in it is too large or too small.
    UnicodeDecodeError, RecursionError
        If it is no text, or nested too deeply.
    """
    if (_FAR[0].search(text) if isinstance(text, str) else _FAR[1].search(text)) is not None:
        try:
            json.loads(text, parse_float=_near)
        except ValueError as error:
            raise msgspec.DecodeError(str(error)) from error
    return decoder.decode(text)


def _near(written: str) -> float:
    value = float(written)
    if value and not SMALLEST <= abs(value) <= LARGEST:
        raise ValueError(f"a number must be 0, or from {SMALLEST:g} to {LARGEST:g} in size, got {written[:40]}")
    return value


def encode(message: ClientMessage | ServerMessage) -> str:
    """Write a message as JSON."""
    return _encoder.encode(message).decode()


def schema() -> dict[str, Any]:
    """Return the JSON schema of all messages of both sides."""
    schemas, definitions = msgspec.json.schema_components([ClientMessage, ServerMessage], ref_template="#/$defs/{name}")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": SUBPROTOCOL,
        "properties": {"client": schemas[0], "server": schemas[1]},
        "$defs": definitions,
    }
