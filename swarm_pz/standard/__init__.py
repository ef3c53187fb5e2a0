"""The standard: what is played to compare methods, frozen and numbered, and the report that says how one did."""

from swarm_pz.standard.protocol import Protocol, Track, Trial
from swarm_pz.standard.running import Entry, meet, run

__all__ = ["Entry", "Protocol", "Track", "Trial", "meet", "run"]
