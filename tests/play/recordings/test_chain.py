"""Lines that hold together: anybody can compute the links, and anything that is changed breaks them."""

import hashlib
import json

from swarm_pz.play.recordings.chain import START, chained, link_of, unchained
from swarm_pz.play.recordings.format import Recording
from tests.play.recordings.test_format import record


def test_a_line_says_the_hash_of_itself_and_of_the_link_before():
    line, link = chained(b'{"type":"x","a":1}', "0123456789abcdef")
    assert link == hashlib.sha256(b'0123456789abcdef{"type":"x","a":1}').hexdigest()[:16]
    assert line == b'{"type":"x","a":1,"chain":"%s"}' % link.encode()
    assert unchained(line) == (b'{"type":"x","a":1}', link)


def test_a_line_without_a_link_has_none():
    line, link = chained(b'{"a":1}', START)
    for other in (b'{"a":1}', line + b" ", line[:-1], line.replace(link.encode(), link.upper().encode() + b"G"), b""):
        assert unchained(other) is None


def test_a_file_holds_the_chain_that_its_documentation_tells_of(tmp_path):
    record(tmp_path / "a.jsonl", ticks=30)
    before = ""
    for line in (tmp_path / "a.jsonl").read_bytes().splitlines():
        link = json.loads(line)["chain"]
        content = line[: -len(',"chain":"0123456789abcdef"}')] + b"}"
        assert hashlib.sha256(before.encode() + content).hexdigest()[:16] == link == link_of(content, before)
        before = link
    assert Recording.read(tmp_path / "a.jsonl").link == before
