"""The standard: frozen, numbered protocols of games that compare methods, and the report on a method."""

from swarm_pz.standard.attacks import meet
from swarm_pz.standard.protocol import Protocol, Track, Trial
from swarm_pz.standard.running import Entry, run

__all__ = ["Entry", "Protocol", "Track", "Trial", "meet", "run"]
