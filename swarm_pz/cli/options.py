"""Groups of options that several commands have."""

from __future__ import annotations

from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Annotated

import tyro

from swarm_pz.config.base import check_count


@dataclass(frozen=True)
class Workers:
    """Processes or machines that share the work."""

    processes: int = 2
    """Processes that share the games and trainings."""
    ray: str | None = None
    """Use the machines of a Ray cluster instead: auto, or HOST:PORT."""

    def open(self) -> AbstractContextManager[Executor]:
        """Return the pool of the workers."""
        from swarm_pz.evaluation.workers import open_pool

        return open_pool(self.processes, self.ray)


@dataclass(frozen=True)
class Address:
    """The address of a server."""

    host: str = "127.0.0.1"
    """Address to listen on; 0.0.0.0 lets the local network in."""
    port: int = 8000
    """Port to listen on; 0 takes any free one."""

    def __post_init__(self) -> None:
        check_count(self.port, "port", 0, 65535)


WORKERS, ONE_WORKER, HERE = Workers(), Workers(processes=1), Address()
WorkerOptions = Annotated[Workers, tyro.conf.arg(name="")]
AddressOptions = Annotated[Address, tyro.conf.arg(name="")]
