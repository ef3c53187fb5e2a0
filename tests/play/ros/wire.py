"""A connection that can be lost so that only one side notices."""

from __future__ import annotations

import asyncio
import contextlib


class Wire:
    """Passes on what clients and a port say to each other, until it is cut."""

    def __init__(self, port):
        self._to, self._tasks, self._pairs = port, [], []

    async def lay(self):
        """Begin to take connections, and return the port."""
        self._server = await asyncio.start_server(self._meet, "127.0.0.1", 0)
        return self._server.sockets[0].getsockname()[1]

    async def _meet(self, reader, writer):
        there, away = await asyncio.open_connection("127.0.0.1", self._to)
        cut = asyncio.Event()
        self._pairs.append((writer, away, cut))
        self._tasks += [asyncio.create_task(self._carry(*ends, cut)) for ends in ((reader, away), (there, writer))]

    async def _carry(self, source, sink, cut):
        with contextlib.suppress(ConnectionError):
            while (data := await source.read(2**16)) and not cut.is_set():
                sink.write(data)
                await sink.drain()

    def cut(self):
        """Let clients lose their connections; the server's ends stay as they are, and are silent."""
        for client, _, cut in self._pairs:
            cut.set()
            client.transport.abort()

    async def end(self):
        self._server.close()
        for task in self._tasks:
            task.cancel()
        for client, away, _ in self._pairs:
            client.transport.abort()
            away.transport.abort()
        await asyncio.gather(*self._tasks, return_exceptions=True)
