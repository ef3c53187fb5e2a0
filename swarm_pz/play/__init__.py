"""Games that people play: the server, its page, and the recordings."""
