"""Games between policies: matches, tournaments, and their statistics."""

from swarm_pz.evaluation.match import MatchResult, paired_difference, play_match
from swarm_pz.evaluation.rollout import Game, Rollout, game_number
from swarm_pz.evaluation.tournament import Tournament

__all__ = [
    "Game",
    "MatchResult",
    "Rollout",
    "Tournament",
    "game_number",
    "paired_difference",
    "play_match",
]
