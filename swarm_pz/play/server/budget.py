"""What a client may use in a time: so much at once, and what comes back with every second.

The limits stand where they are used: of messages in `connection`, of sockets in `sockets`, of rooms in `lobby`.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import time
from collections.abc import Awaitable, Coroutine, Generator, Iterator
from typing import Any, NamedTuple, TypeVar, cast
from weakref import WeakValueDictionary

T = TypeVar("T")


class Rate(NamedTuple):
    """What may be used at once, and what comes back with every second."""

    most: float
    per_second: float


class Budget:
    """What may be used at once, and what comes back with every second; times are of any clock."""

    def __init__(self, most: float, per_second: float, now: float) -> None:
        self._most, self._per_second = most, per_second
        self._left, self._at = most, now

    def take(self, amount: float, now: float) -> bool:
        """Use some, if it is there; return whether it was."""
        if amount > self.left(now):
            return False
        self.spend(amount, now)
        return True

    def spend(self, amount: float, now: float) -> None:
        """Use some, whether it is there or not: what comes back pays a debt first."""
        self._left, self._at = self.left(now) - amount, now

    def left(self, now: float) -> float:
        """Return what is there; negative is a debt."""
        return min(self._left + (now - self._at) * self._per_second, self._most)

    def debt_s(self, now: float) -> float:
        """Return the seconds until a debt is paid; 0 without one."""
        return max(-self.left(now) / self._per_second, 0.0)

    def is_full(self, now: float) -> bool:
        """Whether all that was used has come back."""
        return self.left(now) >= self._most


class _Address:
    """All connections of an address: their budget, and the line in which they wait for it."""

    def __init__(self, rate: Rate) -> None:
        self.budget, self.line = Budget(*rate, time.monotonic()), asyncio.Lock()


class Account:
    """The processor time of one connection, and of its address; `Accounts` makes them."""

    def __init__(self, rate: Rate, address: _Address) -> None:
        now = time.monotonic()
        self._own, self._address = Budget(*rate, now), address
        # A client that leaves and comes back leaves no debt behind.
        self._own.spend(max(rate.most - address.budget.left(now), 0.0), now)

    def spend(self, seconds: float) -> None:
        """Charge processor time, once it is known."""
        now = time.monotonic()
        self._own.spend(seconds, now)
        self._address.budget.spend(seconds, now)

    @contextlib.contextmanager
    def charged(self) -> Iterator[None]:
        """Charge the processor time of this thread."""
        began = time.thread_time()
        try:
            yield
        finally:
            self.spend(time.thread_time() - began)

    def debt_s(self) -> float:
        """Return the seconds until the connection's own debt is paid; 0 without one."""
        return self._own.debt_s(time.monotonic())

    async def turn(self, *, in_line: bool = True) -> None:
        """Wait until the connection has no debt, and then, in line with its neighbours, until its address has none."""
        while (debt_s := self.debt_s()) > 0.0:
            await asyncio.sleep(debt_s)
        if in_line:
            async with self._address.line:
                while (debt_s := self._address.budget.debt_s(time.monotonic())) > 0.0:
                    await asyncio.sleep(debt_s)

    async def run(self, work: Coroutine[Any, Any, T]) -> T:
        """Await work, and charge the processor time of its steps; not that of threads or tasks that it begins."""
        return await _Metered(work, self)


class _Metered(Awaitable[T]):
    """Work that is charged step by step, as `Account.run` says."""

    def __init__(self, work: Coroutine[Any, Any, T], account: Account) -> None:
        self._work, self._account = work, account

    def __await__(self) -> Generator[Any, None, T]:
        fault: BaseException | None = None
        while True:
            try:
                with self._account.charged():
                    waits_for = self._work.send(None) if fault is None else self._work.throw(fault)
            except StopIteration as end:
                return cast("T", end.value)
            fault = None
            try:
                yield waits_for
            except BaseException as error:  # such as a cancellation: the work handles it
                fault = error


class Accounts:
    """The processor time that clients may use: little for a connection, more for an address that many share.

    - `connection`, `address`: seconds of processor time.
    - `silent`: the address of each connection that has asked for nothing yet, the oldest first.
    """

    def __init__(self, connection: Rate, address: Rate) -> None:
        self.silent: dict[Any, str] = {}
        self._connection, self._address = connection, address
        self._addresses: dict[str, _Address] = {}
        self._accounts: WeakValueDictionary[tuple[str, int], Account] = WeakValueDictionary()
        self._others = itertools.count(1)

    def of(self, client: tuple[str, int] | None) -> Account:
        """Return the account of a connection from this address and port; a new one where a proxy tells no port."""
        host, port = client or ("", 0)
        key = host, port or -next(self._others)
        account = self._accounts.get(key)
        if account is None:
            address = self._addresses.setdefault(host, _Address(self._address))
            account = self._accounts[key] = Account(self._connection, address)
        return account

    def forget(self, now: float) -> None:
        """Forget addresses that have no connection, and no debt."""
        here = {host for host, _ in self._accounts}
        self._addresses = {
            host: one for host, one in self._addresses.items() if host in here or not one.budget.is_full(now)
        }
