"""The table's server: rooms, the clients in them, and games in real time."""
