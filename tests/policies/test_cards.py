"""Cards: what the table shows of a policy before one plays it."""

from benchmarks.policy_cards import CELLS, LADDER, ratings, ratings_at_table
from swarm_pz.policies.cards import cards
from swarm_pz.policy import registered


def test_every_policy_on_the_ladder_has_a_card_with_its_rating():
    known, page = cards(), LADDER.read_text()
    assert known.keys() == ratings(page).keys() <= registered().keys()
    assert {name: card.rating for name, card in known.items()} == ratings_at_table(page)
    changed = {name: known[name].rating for name, rating in ratings(page).items() if rating != known[name].rating}
    assert changed == {"master": known["veteran"].rating}, "which recognises nobody at a table"


def test_a_card_shows_a_target_and_drones_on_the_square():
    for name, card in cards().items():
        assert len(card.target) == CELLS and {len(row) for row in card.target} == {CELLS}, name
        assert set("".join(card.target)) <= set("0123456789") and "9" in "".join(card.target), name
        assert card.drones and all(0 <= place <= 100 for drone in card.drones for place in drone), name
