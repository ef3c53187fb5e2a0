"""Who is better: games played by policies, tournaments, and what can be said from them."""
