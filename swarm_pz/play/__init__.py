"""People at the table: a server, the page it serves, and the recordings it leaves."""
