"""The messages of the published tablet app, sent by roslibpy of any version; prints JSON lines. Needs roslibpy alone.

python tests/play/ros/tablet.py PORT TEAM DEPLOYS PAUSE_S SUBSCRIBER_PORT

It never subscribes; beside it a second client, at a port of its own, subscribes to where the team's drones are.
"""

from __future__ import annotations

import json
import math
import random
import sys
import time

import roslibpy

CELLS = 50


def image(draw: random.Random) -> list[float]:
    """Return a wide spot somewhere (2,500), row 0 at the bottom, of sum 10."""
    x, y = 0.2 + 0.6 * draw.random(), 0.2 + 0.6 * draw.random()
    centres = [(cell + 0.5) / CELLS for cell in range(CELLS)]
    values = [math.exp(-((column - x) ** 2 + (row - y) ** 2) / 2.0) for row in centres for column in centres]
    return [10.0 * value / sum(values) for value in values]


def tell(**what: object) -> None:
    """Print a line."""
    print(json.dumps(what), flush=True)


def connected(port: int) -> roslibpy.Ros:
    """Return a client that is connected; it comes back by itself after a loss."""
    ros = roslibpy.Ros(host="127.0.0.1", port=port)
    ros.run(timeout=60)
    return ros


def deploy(ros: roslibpy.Ros, team: str, data: list[float]) -> None:
    """Advertise, and publish once, as the app does."""
    topic = roslibpy.Topic(ros, "/tablet_comm", "ergodic_humanswarmcollab_sim/tablet")
    topic.advertise()
    content = {"name": "attract data", "team": team, "data": data, "map_width": CELLS, "map_height": CELLS}
    topic.publish(roslibpy.Message(content))


def main() -> None:
    """Connect, deploy, and listen until the input ends."""
    _, port, team, deploys, pause_s, subscriber_port = sys.argv
    draw, poses = random.Random(1), []  # noqa: S311
    subscriber = connected(int(subscriber_port))
    listening = roslibpy.Topic(subscriber, f"/swarm/{team}/poses", "geometry_msgs/PoseArray", queue_length=1)
    listening.subscribe(lambda message: poses.append((time.monotonic(), message["header"]["stamp"])))
    ros = connected(int(port))
    service = roslibpy.Topic(ros, f"{team}_connection_service", "std_msgs/Empty")
    service.advertise()
    service.publish(roslibpy.Message({}))
    while not poses:
        time.sleep(0.1)  # the game begins when the opponent is loaded
    tell(version=roslibpy.__version__, began=True)
    for number in range(int(deploys)):
        while not ros.is_connected:
            time.sleep(0.05)
        data = image(draw)
        deploy(ros, team, data)
        tell(deploy=number, data=data)
        time.sleep(float(pause_s))
    tell(deployed=True)
    sys.stdin.read()
    tell(poses=[(at, 30 * stamp["sec"] + round(stamp["nanosec"] * 30e-9)) for at, stamp in poses])
    ros.close()
    subscriber.terminate()


if __name__ == "__main__":
    main()
