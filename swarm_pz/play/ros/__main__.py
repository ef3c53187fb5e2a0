"""Print the topics of the rosbridge with their types, as CSV: python -m swarm_pz.play.ros."""

from __future__ import annotations

from swarm_pz.play.ros import commands, messages, robots

if __name__ == "__main__":
    print("direction,topic,type")  # noqa: T201
    read, published = commands.INPUTS | robots.INPUTS, messages.TOPICS | robots.TOPICS
    for direction, topics in (("read", read), ("published", published)):
        for topic, kind in topics.items():
            print(f"{direction},{topic},{kind}")  # noqa: T201
