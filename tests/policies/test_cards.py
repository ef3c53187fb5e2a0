"""Cards of policies on the page."""

from benchmarks.policy_cards import LADDER, ratings
from swarm_pz.cli.play import _cards
from swarm_pz.policy import registered


def test_every_policy_on_the_ladder_has_a_card_with_its_rating():
    rated = ratings(LADDER.read_text())
    assert rated.keys() <= registered().keys()
    assert {name: card.rating for name, card in _cards().items()} == rated
