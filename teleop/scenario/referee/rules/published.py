"""Rules of what the robot publishes of its pose: what it believes, and when."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import Estimate, Pose
from teleop.robot.tick_record import TickRecord
from teleop.scenario.referee.rules.command_in_force import TICK
from teleop.scenario.referee.rules.published_messages import Beliefs, stamp_of
from teleop.scenario.referee.rules.rule import Rule, RunFacts

_POSES: Final = ("/tf", "/odom", "/amcl_pose")
_EXACT: Final = 1e-6
"""Tolerance of comparisons of doubles that have been through text [m, rad, m/s, rad/s]."""
_EVERY: Final = {"/tf": 2, "/odom": 2, "/amcl_pose": 5}
"""Ticks between two messages (docs/topics.md)."""


class PublishedIsBelieved(Rule):
    """Clients receive the robot's own estimate."""

    name = "published"
    sentence = (
        "the poses of `/tf`, `/odom` and `/amcl_pose`, with speeds and covariance, are the robot's estimate of "
        "their stamps, in the frames of REP 105"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._beliefs = Beliefs()

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        self._beliefs.take(tick)
        for topic, message in self.facts.published.of(*_POSES):
            believed = self._beliefs.at(stamp_of(message))
            if believed is None:
                return f"{topic} bears a stamp of no tick of the last 10 s"
            wrong = _READ[topic](message, believed)
            if wrong is not None:
                return f"{wrong} on {topic} is not the robot's estimate of that time"
        return None


def _wrong_transforms(message: dict[str, Any], believed: Estimate) -> str | None:
    """Return what is wrong with ``/tf``: chained, it leads from ``map`` to the robot, and from ``odom``."""
    found = {}
    for each in message["transforms"]:
        moved = each["transform"]
        frames = each["header"]["frame_id"], each["child_frame_id"]
        if frames[0].startswith("arm_"):
            continue  # where the arm's links are is no estimate
        found[frames] = _pose(moved["translation"], moved["rotation"])
    base = found.pop(("odom", "base_link"), None)
    if base is None or not _same(base, believed.odom_from_base):
        return "the transform from odom to base_link"
    odom = found.pop(("map", "odom"), None)
    if (odom is None) is not (believed.map_from_base is None) or found:
        return f"the list of transforms ({len(message['transforms'])})"
    if odom is None or believed.map_from_base is None:
        return None
    return None if _same(odom @ base, believed.map_from_base) else "the pose in map"


def _wrong_odometry(message: dict[str, Any], believed: Estimate) -> str | None:
    if (message["header"]["frame_id"], message["child_frame_id"]) != ("odom", "base_link"):
        return "the frame"
    if not _same(_pose_of(message), believed.odom_from_base):
        return "the pose"
    twist = message["twist"]["twist"]
    sent = np.concatenate((_vector(twist["linear"]), _vector(twist["angular"])))
    own = np.concatenate((believed.twist.linear, believed.twist.angular))
    return None if np.abs(sent - own).max() < _EXACT else "the speed"


def _wrong_pose(message: dict[str, Any], believed: Estimate) -> str | None:
    if message["header"]["frame_id"] != "map":
        return "the frame"
    pose = believed.map_from_base
    if pose is None or not _same(_pose_of(message), pose):
        return "the pose"
    sent = np.array(message["pose"]["covariance"], dtype=float).reshape(6, 6)
    # REP 103: rotations about the fixed axes of the frame; the robot's own are about its own axes.
    own = believed.covariance.copy()
    own[:, 3:] = own[:, 3:] @ pose.rotation.T
    own[3:, :] = pose.rotation @ own[3:, :]
    return None if np.allclose(sent, own, rtol=1e-6, atol=1e-12) else "the covariance"


_READ: Final = {"/tf": _wrong_transforms, "/odom": _wrong_odometry, "/amcl_pose": _wrong_pose}


def _pose_of(message: dict[str, Any]) -> Pose:
    pose = message["pose"]["pose"]
    return _pose(pose["position"], pose["orientation"])


def _pose(position: dict[str, float], orientation: dict[str, float]) -> Pose:
    turn = np.array([float(orientation[axis]) for axis in "wxyz"])
    return Pose(_vector(position), turn)


def _vector(fields: dict[str, float]) -> FloatArray:
    return np.array([float(fields[axis]) for axis in "xyz"])


def _same(sent: Pose, own: Pose) -> bool:
    """Return whether two poses are the same but for rounding."""
    apart = float(np.abs(sent.position - own.position).max())
    return apart < _EXACT and float(np.abs(sent.rotation - own.rotation).max()) < _EXACT


class PublishedInTime(Rule):
    """What is published comes when it is due, and time goes on in it."""

    name = "in-time"
    sentence = (
        "who asks for `/tf`, `/odom`, `/amcl_pose` and `/local_cloud` without limits is sent each when it is due, "
        "with the stamp of its tick; nobody is sent an older message after a newer one"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._newest: dict[tuple[int, str], int] = {}

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        published, fresh = self.facts.published, set()
        for each in published.deliveries:
            stamp, key = stamp_of(each.message), (each.client, each.topic)
            if stamp < self._newest.get(key, 0):
                return f"{each.topic} goes back in time"
            if stamp > tick.stamp:
                return f"{each.topic} bears a time to come"
            self._newest[key] = stamp
            if each.client == published.witness and stamp == tick.stamp:
                fresh.add(each.topic)
        if published.witness is None:
            return None
        missing = _due(tick) - fresh
        return f"no {min(missing)} of this tick, though one is due" if missing else None


def _due(tick: TickRecord) -> set[str]:
    """Return the topics that are due after a tick."""
    due = {topic for topic, every in _EVERY.items() if tick.stamp // TICK % every == 0}
    estimate = tick.estimate
    if estimate.map_from_base is None:
        due.discard("/amcl_pose")
    elif estimate.sweep is not None and estimate.match is not None:
        due.add("/local_cloud")
    return due
