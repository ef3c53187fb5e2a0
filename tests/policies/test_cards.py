"""Cards of policies on the page."""

from benchmarks.policy_cards import CELLS, LADDER, ratings
from swarm_pz.policies.cards import cards
from swarm_pz.policy import registered


def test_every_policy_on_the_ladder_has_a_card_with_its_rating():
    rated = ratings(LADDER.read_text())
    assert rated.keys() <= registered().keys()
    assert {name: card.rating for name, card in cards().items()} == rated


def test_a_card_shows_a_target_and_drones_on_the_square():
    for name, card in cards().items():
        assert len(card.target) == CELLS and {len(row) for row in card.target} == {CELLS}, name
        assert set("".join(card.target)) <= set("0123456789") and "9" in "".join(card.target), name
        assert card.drones and all(0 <= place <= 100 for drone in card.drones for place in drone), name
