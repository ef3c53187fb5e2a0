"""Prints the JSON schema of all messages: python -m swarm_pz.play.protocol."""

import json

from swarm_pz.play.protocol.encoding import schema

print(json.dumps(schema(), indent=2))  # noqa: T201
