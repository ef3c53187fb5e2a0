"""Messages: which are valid, which are refused, and that the documentation names each."""

import json
from pathlib import Path
from unittest.mock import Mock

import pytest

from swarm_pz.errors import ProtocolError
from swarm_pz.play import protocol

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "protocol.md").read_text()


def test_messages_are_told_apart_by_their_type():
    command = protocol.CommandMessage(3, strokes=[protocol.StrokeMessage("attract", 0.1, [(0.5, 0.25)])])
    text = protocol.encode(command)
    assert json.loads(text)["type"] == "command" and protocol.decode_client(text) == command
    pong = protocol.Pong(1.0, 2.0)
    assert protocol.decode_server(protocol.encode(pong)) == pong


LABELS = [*map(chr, (0, 9, 10, 13, 27, 127, 0x9B, 0x2028, 0x202E)), "x" * 41]
NO_MESSAGES = [
    "", "{", "[]", "null", '{"type":"obey"}', '{"type":"welcome"}', '{"type":"command"}',
    '{"type":"command","number":-1}', '{"type":"command","number":4294967296,"density":[[0.5]]}',
    '{"type":"command","number":1,"density":[[NaN]]}',
    '{"type":"command","number":1,"density":[["1"]]}',
    '{"type":"command","number":1,"strokes":[{"brush":"attract","width":0.1,"points":[]}]}',
    '{"type":"command","number":1,"strokes":[{"brush":"pull","width":0.1,"points":[[0,0]]}]}',
    '{"type":"join","room":"../X"}', '{"type":"join","room":"ABCD","seat":"green"}', '{"type":"hello","token":"short"}',
    '{"type":"hello","admin":true}', '{"type":"create","settings":{"red":1000000}}',
    *(json.dumps({"type": "create", "label": f"a{label}"}) for label in LABELS),
    json.dumps({"type": "join", "room": "ABCD", "label": "a\r"}),
    "[" * 60_000, '{"x":' + "[" * 60_000, " " * 70_000, b"\xff\xfe",
]  # fmt: skip


@pytest.mark.parametrize("text", NO_MESSAGES)
def test_what_does_not_fit_is_refused(text):
    with pytest.raises(ProtocolError):
        protocol.decode_client(text)


def test_the_longest_message_is_read_and_a_longer_one_is_not():
    text = protocol.encode(protocol.Ping(1.0))
    assert protocol.decode_client(text + " " * (65_536 - len(text))) == protocol.Ping(1.0)
    with pytest.raises(ProtocolError, match="65536"):
        protocol.decode_client(text + " " * (65_537 - len(text)))


@pytest.mark.parametrize("label", ["", "P1", "[/p1]", "=1+1", "Zoë Ñandú", "名前", "👩\u200d🚀 1", "x" * 40])
def test_a_label_is_any_line_of_text(label):
    assert protocol.decode_client(protocol.encode(protocol.Create(label=label))).label == label


def test_numbers_that_take_long_to_read_are_refused_and_words_like_them_are_not(monkeypatch):
    words = protocol.decode_client(f'{{"type":"hello","token":"{"1e30" * 8}"}}')
    assert words.token == "1e30" * 8
    assert protocol.decode_client('{"type":"command","number":1,"density":[[3e-120,0e999]]}').density == [[3e-120, 0.0]]
    monkeypatch.setattr(protocol, "_client_decoder", Mock())
    for number in ("1e300", "-2.5E+23", "5e-324", "12e00301"):
        with pytest.raises(ProtocolError, match="a number must be 0, or from 1e-300 to 1e"):
            protocol.decode_client(f'{{"type":"ping","sent_ms":{number}}}')
    protocol._client_decoder.decode.assert_not_called()


# --- what is published ----------------------------------------------------------------------------


def test_the_page_names_every_message():
    for message in (*protocol.ClientMessage.__args__, *protocol.ServerMessage.__args__, *protocol.LogMessage.__args__):
        assert f"`{message.__struct_config__.tag}`" in PAGE
