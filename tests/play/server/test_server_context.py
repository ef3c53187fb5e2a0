"""A late game clock."""

from types import SimpleNamespace

import pytest

from swarm_pz.play.server import server_context
from swarm_pz.play.server.server_context import GameClock


async def test_ticks_are_caught_up_two_at_a_time_and_then_time_slips(monkeypatch):
    now = [100.0]

    async def sleep(seconds):
        now[0] += seconds

    loop = SimpleNamespace(get_running_loop=lambda: SimpleNamespace(time=lambda: now[0]), sleep=sleep)
    monkeypatch.setattr(server_context, "asyncio", loop)
    period = 1 / 60
    clock = GameClock(2.0)
    assert [await clock.due() for _ in range(3)] == [1, 1, 1] and now[0] == pytest.approx(100.0 + 3 * period)
    now[0] += 2.5 * period
    assert [await clock.due() for _ in range(3)] == [2, 1, 1]
    now[0] += 15 * period
    assert await clock.due() == 2
    late = now[0]
    assert await clock.due() == 1 and now[0] == pytest.approx(late + period)
