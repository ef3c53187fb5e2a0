"""Robots of a lab: poses that are lost, late, jumping or outside, and setpoints that keep to the lab's limits."""

from __future__ import annotations

import asyncio
import itertools
import json
import runpy
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar
from unittest.mock import Mock

import numpy as np
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect as sync_connect

from swarm_pz.errors import ProtocolError
from swarm_pz.play import protocol
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.robots import RobotsConfig
from swarm_pz.play.ros.robots import INPUTS, LIGHTS, POSES, SETPOINTS, STATES, STOP, STOPPED, TOPICS, Robots
from swarm_pz.play.server.robots import Orders, apart
from tests.play.conftest import Table

ROOT = Path(__file__).parents[3]
PERIOD = 1 / 30
LAB = RobotsConfig(scale=2.0, corner=(-1.0, -1.0), altitudes=(0.5, 1.0))


def poses_of(places):
    """Return a PoseArray of places; None becomes null coordinates."""
    keys = [dict.fromkeys("xyz") if place is None else dict(zip("xyz", place, strict=True)) for place in places]
    return {"poses": [{"position": key} for key in keys]}


class Lab:
    """Robots that are seen thirty times a second, with a clock of their own."""

    def __init__(self, *places, config=LAB):
        self.lines, self.now = [], 100.0
        self.robots = Robots(config, self.lines.append)
        self.places = [np.array(place, float) for place in places]
        self.see(2)

    def see(self, times=1, hidden=(), follows=False):
        """Let periods pass in which all but the hidden robots are seen; with `follows`, all fly to their setpoints."""
        for _ in range(times):
            self.now += PERIOD
            for number in range(len(self.places)) if follows else ():
                way = self.robots.setpoints[number] - self.places[number]
                most = self.robots.config.max_speed * PERIOD
                self.places[number] = self.places[number] + way * min(1.0, most / max(np.linalg.norm(way), 1e-9))
            shown = [None if n in hidden else place.tolist() for n, place in enumerate(self.places)]
            self.robots.hear(POSES, poses_of(shown), self.now)
            self.robots.step(self.now)

    def order(self, phase="playing", *, accelerations=None, starts=None, teams=None):
        count = len(self.places)
        none, teams = [(0.0, 0.0)] * count, teams or [0] * count
        self.robots.order(Orders(phase, teams, starts or none, accelerations or none), self.now)

    @property
    def sight(self):
        return self.robots.sight().poses

    def messages(self):
        return dict(self.robots.messages(self.now))


def test_the_map_is_the_labs_square_and_velocities_follow_from_poses():
    lab = Lab((-1.0, -1.0, 0.5), (0.5, 0.0, 0.8))
    lab.places[1] += (0.02, 0.0, 0.0)
    lab.see()
    np.testing.assert_allclose(lab.sight, [(0.0, 0.0, 0.0, 0.0), (0.76, 0.5, 0.3, 0.0)], atol=1e-9)


def test_states_hold_velocities_of_robots_by_the_numbers_in_their_names():
    lab = Lab()
    vector = dict(zip("xyz", (0.0, 0.0, 0.6), strict=True))
    point = {"transforms": [{"translation": vector}], "velocities": [{"linear": {"x": 1.0, "y": -0.5, "z": 0.0}}]}
    for _ in range(2):
        lab.robots.hear(STATES, {"joint_names": ["cf02"], "points": [point]}, lab.now)
    lab.robots.step(lab.now)
    assert lab.sight == [None, None, (0.5, 0.5, 0.5, -0.25)]
    for names, hint in ((["left"], "got 'left'"), (["cf2", "cf3"], "for each of them")):
        with pytest.raises(ProtocolError, match=hint):
            lab.robots.hear(STATES, {"joint_names": names, "points": [point]}, lab.now)


@pytest.mark.parametrize("height", [0.5, 0.0])
def test_a_robot_that_is_not_seen_holds_its_place_and_then_has_failed_until_two_poses_agree(height):
    lab = Lab((0.0, 0.0, 0.5))
    lab.order(accelerations=[(1.0, 0.0)])
    lab.see(5, follows=True)
    before = lab.robots.setpoints[0, 0]
    lab.see(22, hidden=[0])
    assert "robots: 0 is late, was seen" in lab.lines and lab.sight[0] is not None
    stopped = lab.robots.setpoints[0, 0]
    assert before < stopped < before + 0.3 and abs(lab.robots.speeds[0, 0]) < 0.05
    lab.see(20, hidden=[0])
    assert lab.sight == [None] and "robots: 0 is lost, was late" in lab.lines
    assert lab.messages()[SETPOINTS]["joint_names"] == [], "its own watchdog is to act"
    lab.places[0] = np.array([-0.5, 0.5, height])
    lab.see(1)
    assert lab.sight == [None], "one pose is not enough"
    lab.see(1)
    lab.order()
    lab.see(2)
    names = lab.messages()[SETPOINTS]["joint_names"]
    if height < 0.2:
        assert lab.sight == [None] and names == [], "it has landed, and no running game makes it take off"
    else:
        assert lab.sight[0][:2] == (0.25, 0.75) and "robots: 0 is seen, was lost" in lab.lines
        np.testing.assert_allclose(lab.robots.setpoints[0, :2], (-0.5, 0.5), atol=0.05)
        assert names == ["agent0"]
    lab.order("starting", starts=[(0.5, 0.5)])
    lab.see(1)
    assert lab.messages()[SETPOINTS]["joint_names"] == ["agent0"], "for the next game it takes off"


def test_a_pose_that_jumps_is_left_out():
    lab = Lab((0.0, 0.0, 0.5))
    lab.places[0] = np.array([0.9, 0.9, 0.5])
    lab.see(3)
    assert lab.sight[0][:2] == (0.5, 0.5)
    lab.places[0] = np.array([0.05, 0.0, 0.5])
    lab.see(1)
    assert lab.sight[0][:2] == pytest.approx((0.525, 0.5))
    lab.places[0] = np.array([0.9, 0.9, 0.5])
    lab.see(40)
    assert lab.sight[0][:2] == pytest.approx((0.95, 0.95)), "a robot that stays there was lost, and is found there"
    assert "robots: 0 is lost, was late" in lab.lines


@pytest.mark.parametrize("place", [(1.4, 0.0, 0.5), (0.0, 0.0, 0.1), (0.0, 0.0, 1.4)])
def test_a_robot_beyond_the_fence_has_failed_and_is_led_back(place):
    lab = Lab((0.9, 0.0, 0.5))
    lab.order()
    lab.see()
    way = (np.array(place) - lab.places[0]) / 20
    for _ in range(20):
        lab.places[0] += way
        lab.see()
    assert lab.sight == [None] and "robots: 0 is outside, was seen" in lab.lines
    assert (np.abs(lab.robots.setpoints[0, :2]) <= 1.0).all() and lab.messages()[SETPOINTS]["joint_names"] == ["agent0"]
    lab.see(150, follows=True)
    assert lab.sight[0] is not None and lab.robots.states[0] == "seen"


def test_setpoints_fly_as_orders_say_within_the_map_and_the_speed_limit():
    lab = Lab((0.0, 0.0, 0.5))
    lab.order(accelerations=[(1.0, 0.0)])
    lab.see(3, follows=True)
    np.testing.assert_allclose(lab.robots.speeds[0, 0], 3 * 2.0 * PERIOD, rtol=1e-6)
    (point,) = lab.messages()[SETPOINTS]["points"]
    assert point["accelerations"][0]["linear"] == pytest.approx({"x": 2.0, "y": 0.0, "z": 0.0})
    for _ in range(60):
        lab.order(accelerations=[(5.0, 0.0)])
        lab.see(1, follows=True)
        assert np.linalg.norm(lab.robots.speeds[0]) <= LAB.max_speed + 1e-9
    assert lab.robots.setpoints[0, 0] == 1.0 and lab.robots.speeds[0, 0] == 0.0
    lab.see(40)
    assert not lab.robots.accelerations[0].any(), "orders that stop coming hold for half a second"


def test_a_setpoint_stays_near_its_robot():
    lab = Lab((-1.0, 0.0, 0.5))
    for _ in range(60):
        lab.order(accelerations=[(1.0, 0.0)])
        lab.see(1)
    assert np.linalg.norm(lab.robots.setpoints[0] - lab.places[0]) <= LAB.leash + 1e-9


def test_setpoints_stay_apart_and_robots_keep_altitudes_of_their_own():
    generator = np.random.default_rng(3)
    lab = Lab(*[(x, y, 0.4) for x, y in itertools.product((-0.8, 0.0, 0.8), (-0.6, 0.6))])
    for tick in range(300):
        if tick % 30 == 0:
            accelerations = generator.uniform(-1.0, 1.0, (6, 2)).tolist()
        lab.order(accelerations=accelerations)
        lab.see(1, follows=True)
        places = lab.robots.setpoints[:6, :2]
        distances = np.linalg.norm(places[:, None] - places[None], axis=-1)[~np.eye(6, dtype=bool)]
        assert distances.min() > 0.95 * LAB.separation
    np.testing.assert_allclose(lab.robots.setpoints[:6, 2], np.linspace(0.5, 1.0, 6), atol=1e-3)


def test_setpoints_that_meet_or_reach_a_wall_slow_down_before():
    lab, former = Lab((-0.9, 0.0, 0.5), (0.3, 0.0, 1.0)), np.zeros((2, 3))
    for tick in range(150):
        lab.order(accelerations=[(0.4, 0.0), (0.4 if tick > 45 else -0.4, 0.0)])
        lab.see(1, follows=True)
        change = np.abs(lab.robots.speeds[:2] - former).max()
        assert change <= 2.5 * PERIOD, "no faster than they speed up, and brake"
        former = lab.robots.speeds[:2].copy()
    assert lab.robots.setpoints[1, 0] > 0.9


def test_robots_of_one_place_part_slowly():
    lab = Lab((0.0, 0.0, 0.5), (0.0, 0.0, 1.0))
    lab.order()
    lab.see(30, follows=True)
    away = lab.robots.setpoints[0] - lab.robots.setpoints[1]
    assert np.hypot(away[0], away[1]) > 0.95 * LAB.separation


def test_robots_take_off_for_a_game_and_are_led_to_their_starts():
    lab = Lab((0.9, 0.9, 0.0), (-0.9, 0.5, 0.0))
    lab.see(10)
    assert lab.messages()[SETPOINTS]["joint_names"] == [] and lab.robots.setpoints[0, 2] == 0.0
    lab.order("starting", starts=[(0.1, 0.1), (0.5, 0.5)])
    former = lab.robots.setpoints[0].copy()
    for _ in range(250):
        lab.see(1, follows=True)
        assert np.linalg.norm(lab.robots.setpoints[0] - former) <= 0.6 * PERIOD
        former = lab.robots.setpoints[0].copy()
    np.testing.assert_allclose(lab.places, [(-0.8, -0.8, 0.5), (0.0, 0.0, 1.0)], atol=0.01)


def test_robots_that_meet_on_the_way_to_their_starts_pass_each_other():
    lab = Lab((-0.8, 0.0, 0.5), (0.8, 0.0, 1.0))
    lab.order("starting", starts=[(0.9, 0.5), (0.1, 0.5)])
    lab.see(300, follows=True)
    np.testing.assert_allclose(lab.places, [(0.8, 0.0, 0.5), (-0.8, 0.0, 1.0)], atol=0.01)


def test_starts_that_are_too_close_are_moved_apart():
    crowd = np.array([(0.0, 0.0)] * 3 + [(0.02, 0.03), (0.5, 0.5), (1.0, 0.99)], np.float32)
    crowd[:3] += np.random.default_rng(0).uniform(0.0, 0.01, (3, 2)).astype(np.float32)
    places = apart(crowd, 0.1)
    distances = np.linalg.norm(places[:, None] - places[None], axis=-1)[~np.eye(6, dtype=bool)]
    assert distances.min() >= 0.1 and places.min() >= 0.0 and places.max() <= 1.0
    np.testing.assert_array_equal(places[4:], crowd[4:])


def test_lights_show_teams_and_are_off_of_robots_that_have_failed():
    lab = Lab((0.0, 0.0, 0.5), (0.5, 0.0, 1.0), (-0.5, 0.0, 1.0))
    lab.order(teams=[0, 1, 0])
    lab.see(40, hidden=[2])
    red, blue, dark = np.reshape(lab.messages()[LIGHTS]["data"], (3, 3))
    assert red[0] > red[2] and blue[2] > blue[0] and not dark.any()


def test_after_an_emergency_stop_there_are_no_setpoints():
    lab = Lab((0.0, 0.0, 0.5))
    assert lab.messages()[STOPPED] == {"data": False}
    lab.robots.hear(STOP, {}, lab.now)
    messages = lab.messages()
    assert messages[STOPPED] == {"data": True} and messages[SETPOINTS]["joint_names"] == []


def test_a_stray_number_is_no_obstacle_and_leaves_altitudes_as_they_are():
    lab = Lab((-0.5, 0.0, 0.5), (0.5, 0.5, 1.0))
    stray = {"joint_names": ["cf99"], "points": [{"transforms": [{"translation": dict.fromkeys("xyz", 0.9)}]}]}
    for _ in range(2):
        lab.robots.hear(STATES, stray, lab.now)
    for _ in range(120):
        lab.order(accelerations=[(0.5, 0.0), (0.0, 0.0)], teams=[0, 1])
        lab.see(follows=True)
    assert lab.places[0][0] > 0.7, "nobody was ever seen at the lab's origin"
    np.testing.assert_allclose([place[2] for place in lab.places], (0.5, 1.0), atol=0.01)


def test_a_robot_that_is_found_far_away_is_not_flown():
    lab = Lab((50.0, 0.0, 0.5), (0.0, 0.0, 0.0))
    lab.order("starting")
    lab.see()
    assert lab.messages()[SETPOINTS]["joint_names"] == ["agent1"], "from the ground it takes off"


def test_a_stamp_of_any_size_is_read():
    lab = Lab((0.0, 0.0, 0.5))
    lab.robots.hear(POSES, {"header": {"stamp": {"sec": 10**400, "nanosec": 0}}} | poses_of([(0, 0, 0.5)]), lab.now)


@pytest.mark.parametrize("message", [{}, {"poses": 3}, {"poses": [None]}, {"poses": [{}]}, poses_of([None] * 101)])
def test_poses_of_another_form_are_refused(message):
    with pytest.raises(ProtocolError, match="must"):
        Lab((0.0, 0.0, 0.5)).robots.hear(POSES, message, 100.0)


# --- through a server -----------------------------------------------------------------------------


async def fly(port, drones, moments):
    """Fly robots that reach their setpoints at once, and return the log; `moments` maps seconds to hidden robots.

    It returns None for an emergency stop.
    """
    places = {n: [0.2 * n - 0.5, 0.3, 0.5] for n in range(drones)}
    async with connect(f"ws://127.0.0.1:{port}", max_size=None) as client:

        async def say(**message):
            await client.send(json.dumps(message))

        async def see():
            while True:
                shown = [None if n in hidden else place for n, place in places.items()]
                await say(op="publish", topic=POSES, msg=poses_of(shown))
                await asyncio.sleep(PERIOD)

        hidden, log = set(), []
        for topic in (SETPOINTS, "/clock", "/rosout", STOPPED):
            await say(op="subscribe", topic=topic)
        await say(op="publish", topic="/red_connection_service", msg={})
        seeing = asyncio.create_task(see())
        async for data in client:
            message = json.loads(data)
            match message["topic"], message["msg"]:
                case "/robots/setpoints", setpoints:
                    transforms = setpoints["points"][0]["transforms"]
                    for name, transform in zip(setpoints["joint_names"], transforms, strict=True):
                        places[int(name[5:])] = [transform["translation"][axis] for axis in "xyz"]
                case "/clock", clock:
                    hidden = moments(clock["clock"]["sec"])
                    if hidden is None:
                        await say(op="publish", topic=STOP, msg={})
                        hidden = set()
                case "/rosout", line:
                    log.append(line["msg"])
                    if "the game is over" in line["msg"]:
                        seeing.cancel()
                        return log
    raise AssertionError(log)


def test_a_game_waits_for_its_robots_is_played_where_they_are_and_ends_with_an_emergency_stop(tmp_path):
    table = Table(tmp_path, "--poses", "--rosbridge", "0", "--ros-opponent", "uniform", "--game.drones-per-team", "3")
    port = next(line for line in table.process.stdout if "rosbridge is at" in line).rpartition(":")[2].strip()
    with pytest.raises(InvalidStatus), sync_connect(f"ws://{table.address}/robots?token=0"):
        pass
    page, other, third = (table.visit() for _ in range(3))

    def begin(client):
        client.say(protocol.Create(opponent="uniform", settings=protocol.Settings(red=3, blue=3)))
        client.say(protocol.Ready())

    begin(page)
    assert page.hear(protocol.RoomState, lambda room: room.phase == "starting").settings.speed == 0.5, "of the lab"
    assert "waits until robots 0, 1, 2, 3, 4, 5 are at their starts" in page.hear(protocol.Notice).text
    begin(other)
    assert "the robots fly another game" in other.hear(protocol.Notice).text
    page.say(protocol.Leave())
    page.say(protocol.Ping(1.0))
    page.hear(protocol.Pong)  # so the game has ended

    def moments(second):
        return {4} if second == 1 else set() if second < 4 else None

    log = asyncio.run(asyncio.wait_for(fly(int(port), 6, moments), 300.0))
    assert any("4 is lost, was late" in line for line in log) and any("4 is seen, was lost" in line for line in log)
    assert any("emergency stop was made" in line for line in log)
    begin(third)
    assert "restart swarm-pz" in third.hear(protocol.Notice).text
    table.end()
    assert table.process.returncode in (0, -15), "the rosbridge ends with it"
    (path,) = tmp_path.glob("*.jsonl")
    recording = Recording.read(path)
    assert Playback(recording).verify().verified
    assert recording.end.ended_by == "server" and recording.end.tick >= 4 * 30
    lost = [bool(np.isnan(poses[4]).any()) for _, poses in sorted(recording.poses.items())]
    assert 0 < sum(lost) < 60 and not lost[0] and not lost[-1]
    flown = np.ptp([frame.positions for frame in recording.frames()], axis=0)
    assert (flown.max(axis=1) > 0.05).all(), "every robot has moved"


# --- examples -------------------------------------------------------------------------------------


class Drone:
    """A stand-in for a Crazyflie of Crazyswarm2, which notes what it is told."""

    def __init__(self, name):
        self.prefix, self.calls = f"/{name}", []

    def __getattr__(self, name):
        return lambda *arguments: self.calls.append((name, *arguments))


class Topic:
    """A stand-in for a topic of roslibpy."""

    known: ClassVar = {}

    def __init__(self, ros, name, kind):
        self.name, self.kind, self.sent, self.callback = name, kind, [], None
        self.known[name] = self

    def subscribe(self, callback):
        self.callback = callback

    def publish(self, message):
        self.sent.append(message)


@pytest.fixture
def crazyswarm2(monkeypatch):
    """Give the bridge to Crazyswarm2 with two drones, without ROS."""
    for name in ("rclpy", "roslibpy", "crazyflie_py", "motion_capture_tracking_interfaces"):
        monkeypatch.setitem(sys.modules, name, Mock())
    for name in ("rclpy.qos", "motion_capture_tracking_interfaces.msg"):
        monkeypatch.setitem(sys.modules, name, Mock())
    monkeypatch.setattr(sys.modules["roslibpy"], "Topic", Topic)
    monkeypatch.setattr(sys.modules["roslibpy"], "Message", dict)
    program = runpy.run_path(str(ROOT / "examples/crazyswarm2_bridge.py"))
    swarm = Mock()
    swarm.allcfs.crazyflies = [Drone("cf0"), Drone("cf1")]
    return program["Bridge"](swarm, None), swarm


def test_the_bridge_to_crazyswarm2_passes_on_what_the_game_understands(crazyswarm2):
    bridge, swarm = crazyswarm2
    stamp, lab = SimpleNamespace(sec=1, nanosec=5), Lab()
    for place in ((0.5, 0.0, 0.6), (0.5, 0.1, 0.6)):
        pose = SimpleNamespace(position=SimpleNamespace(**dict(zip("xyz", place, strict=True))))
        header = SimpleNamespace(stamp=stamp, frame_id="world")
        bridge.see(SimpleNamespace(header=header, poses=[SimpleNamespace(name="cf1", pose=pose)]))
        states = Topic.known["/robots/states"]
        assert states.kind == INPUTS[STATES]
        lab.robots.hear(STATES, json.loads(json.dumps(states.sent[-1])), lab.now)
        lab.now += PERIOD
    lab.robots.order(Orders("playing", [0, 1], [(0.0, 0.0)] * 2, [(0.0, 0.0)] * 2), lab.now)
    lab.robots.step(lab.now)
    assert lab.sight[0] is None and lab.sight[1][:2] == (0.75, 0.55)
    for topic, message in lab.messages().items():
        assert Topic.known[topic].kind == TOPICS[topic]
        Topic.known[topic].callback(message)
    assert bridge.step(lab.now)
    waiting, flown = swarm.allcfs.crazyflies
    ((place, *_),) = [arguments for name, *arguments in flown.calls if name == "cmdFullState"]
    np.testing.assert_allclose(place, lab.robots.setpoints[1])
    assert ("setParam", "ring.solidBlue", 217) in flown.calls and ("setParam", "ring.solidBlue", 0) in waiting.calls
    assert bridge.step(lab.now + 1.0) and flown.calls[-1][0] == "land" and waiting.calls[-1][0] == "setParam"
    lab.robots.hear(STOP, {}, lab.now)
    Topic.known[STOPPED].callback(lab.messages()[STOPPED])
    assert not bridge.step(lab.now) and swarm.allcfs.emergency.called


def test_the_ergodic_metric_of_the_example_is_small_of_drones_that_fly_their_target():
    metric = runpy.run_path(str(ROOT / "examples/crazyflow_game.py"))["metric"]
    places = np.random.default_rng(0).random((600, 10, 2))
    teams = np.arange(10) // 5 * np.ones((600, 1), int)
    places[:, 5:, 0] /= 2.0
    left = np.tile([1.0] * 5 + [0.0] * 5, (10, 1))
    assert metric(places, teams, 0, np.ones((10, 10))) < 1e-3 > metric(places, teams, 1, left)
    assert min(metric(places, teams, 1, np.ones((10, 10))), metric(places, teams, 1, left.T)) > 0.05
