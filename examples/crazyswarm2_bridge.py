"""Crazyflies of Crazyswarm2 fly a game: poses go to the rosbridge of `swarm-pz play --poses`, setpoints come back.

pip install roslibpy, and source ROS 2 and Crazyswarm2; the drone cf3 is robot 3. See docs/robots.md.
"""

from __future__ import annotations

import argparse
import re
import time

import rclpy
import roslibpy
from crazyflie_py import Crazyswarm
from motion_capture_tracking_interfaces.msg import NamedPoseArray
from rclpy.qos import qos_profile_sensor_data

SILENT_S, LANDING_S, LANDED_M = 0.5, 2.0, 0.04
"""Seconds without setpoints after which a drone lands, seconds of the landing, and its height in metres then."""
SOLID = 7
"""Effect of the LED ring: one colour."""


class Bridge:
    """Passes on poses, setpoints, colours and emergency stops."""

    def __init__(self, swarm: Crazyswarm, ros: roslibpy.Ros) -> None:
        self.swarm, self.node = swarm, swarm.allcfs
        self.drones = {number_of(drone.prefix): drone for drone in self.node.crazyflies}
        self.colours: dict[int, tuple[int, int, int]] = {}
        self.heard: dict[str, dict] = {}
        self.flown_s: dict[int, float] = {}
        self.states = roslibpy.Topic(ros, "/robots/states", "trajectory_msgs/MultiDOFJointTrajectory")
        kinds = {"setpoints": "trajectory_msgs/MultiDOFJointTrajectory", "colours": "std_msgs/UInt8MultiArray"}
        for name, kind in (kinds | {"stopped": "std_msgs/Bool"}).items():
            topic = roslibpy.Topic(ros, f"/robots/{name}", kind)
            topic.subscribe(lambda message, name=name: self.heard.update({name: message}))  # in a thread of its own
        self.node.create_subscription(NamedPoseArray, "/poses", self.see, qos_profile_sensor_data)

    def see(self, message: NamedPoseArray) -> None:
        """Publish the poses of a motion capture system."""
        stamp = {"sec": message.header.stamp.sec, "nanosec": message.header.stamp.nanosec}
        places = [one.pose.position for one in message.poses]
        point = {
            "transforms": [{"translation": {axis: getattr(place, axis) for axis in "xyz"}} for place in places],
            "velocities": [],
        }
        header = {"stamp": stamp, "frame_id": message.header.frame_id}
        names = [one.name for one in message.poses]
        self.states.publish(roslibpy.Message({"header": header, "joint_names": names, "points": [point]}))

    def step(self, now: float) -> bool:
        """Pass on new messages, and land drones without setpoints; return False after an emergency stop."""
        if self.heard.pop("stopped", {}).get("data"):
            self.node.emergency()
            return False
        if (setpoints := self.heard.pop("setpoints", None)) is not None:
            self.fly(setpoints, now)
        if (colours := self.heard.pop("colours", None)) is not None:
            self.light(colours["data"])
        for number in [number for number, then in self.flown_s.items() if now - then > SILENT_S]:
            del self.flown_s[number]
            self.drones[number].notifySetpointsStop()
            self.drones[number].land(LANDED_M, LANDING_S)
        return True

    def fly(self, setpoints: dict, now: float) -> None:
        """Send each drone its setpoint."""
        (point,) = setpoints["points"]
        for place, name in enumerate(setpoints["joint_names"]):
            if (drone := self.drones.get(number_of(name))) is not None:
                parts = (("transforms", "translation"), ("velocities", "linear"), ("accelerations", "linear"))
                vectors = [[float(point[part][place][key][axis]) for axis in "xyz"] for part, key in parts]
                drone.cmdFullState(*vectors, 0.0, [0.0, 0.0, 0.0])
                self.flown_s[number_of(name)] = now

    def light(self, values: list[int]) -> None:
        """Set the LED rings whose colour changes."""
        for number, drone in self.drones.items():
            colour = tuple(values[3 * number : 3 * number + 3])
            if len(colour) == 3 and colour != self.colours.get(number):
                self.colours[number] = colour
                names = ("effect", "solidRed", "solidGreen", "solidBlue")
                for name, value in zip(names, (SOLID, *colour), strict=True):
                    drone.setParam(f"ring.{name}", value)


def number_of(name: str) -> int:
    """Return the number at the end of a name."""
    return int(re.search(r"\d+$", name)[0])


def main() -> None:
    """Run the bridge until Ctrl-C or an emergency stop."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9090)
    arguments = parser.parse_args()
    swarm, ros = Crazyswarm(), roslibpy.Ros(host=arguments.host, port=arguments.port)
    ros.run()
    bridge = Bridge(swarm, ros)
    while rclpy.ok() and bridge.step(time.monotonic()):
        rclpy.spin_once(bridge.node, timeout_sec=0.01)


if __name__ == "__main__":
    main()
