"""Which topics of a bag are read, where several hold the same: one robot of several, one odometry of several.

Two odometries read as one would be a robot that leaps between two places, and the scans of two robots one that sees two
rooms. One of them is chosen, and a line names the choice.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from localization.logs.ros_types import IMU, JOINT_STATE, LASER_SCAN, ODOMETRY, POINT_CLOUD

_SCANS: Final = (LASER_SCAN, POINT_CLOUD)
_MOTION: Final = (ODOMETRY, IMU, JOINT_STATE)
_SINGLE: Final = {ODOMETRY: "odometry", IMU: "inertial readings"}
"""Types of which a robot has one source, with their names. Joint states may come on several topics: those of an arm
hold no wheels, and are skipped."""
_DERIVED: Final = {
    ODOMETRY: (
        "truth",
        "filter",
        "fused",
        "ekf",
        "ukf",
        "gps",
        "map",
        "visual",
        "vio",
        "laser",
        "lidar",
        "icp",
    ),
    IMU: ("raw", "camera", "mag", "head", "arm"),
}
"""Parts of names of topics that hold something better left: truth and filters that have used other sensors, and
inertial readings without orientation or not of the base."""


def chosen_topics(
    kinds: Mapping[str, str], counts: Mapping[str, int]
) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return the topics to read with their types, and a line for each choice that was made.

    Args:
        kinds: Type of each topic in the bag.
        counts: Number of messages of each topic.
    """
    kept, notes = dict(kinds), []
    robots = _robots(kinds)
    if len(robots) > 1:
        # Topics of the root belong to every robot unless there is one of its own.
        first = (
            ""
            if "" in robots
            else max(robots, key=lambda s: (_weight(s, kinds, counts), -robots.index(s)))
        )
        others = [space for space in robots if space != first]
        kept = {t: k for t, k in kept.items() if namespace(t) not in others}
        notes.append(
            f"holds {len(robots)} robots, in {', '.join(f'/{r}' for r in robots)}: only the topics of /{first} are"
            " read; choose others with --topics"
        )
    for kind, name in _SINGLE.items():
        topics = [t for t, k in kept.items() if k == kind and counts.get(t, 0)]
        if len(topics) > 1:
            best = min(topics, key=lambda t, kind=kind: (_derived(t, kind), -counts[t], t))  # type: ignore[misc]
            kept = {t: k for t, k in kept.items() if k != kind or t == best}
            notes.append(
                f"{len(topics)} topics hold {name}, {', '.join(sorted(topics))}: {best} is read; choose with"
                " --topics"
            )
    return kept, tuple(notes)


def namespace(topic: str) -> str:
    """Return the first part of a topic's name, ``robot1`` of ``/robot1/scan``; empty if it has no namespace."""
    first, slash, _ = topic.strip("/").partition("/")
    return first if slash else ""


def _robots(kinds: Mapping[str, str]) -> list[str]:
    """Return the namespaces that are robots of their own: with a scanner, if there is any, and with motion."""
    scanning = {namespace(t) for t, k in kinds.items() if k in _SCANS}
    moving = {namespace(t) for t, k in kinds.items() if k in _MOTION}
    rolling = {namespace(t) for t, k in kinds.items() if k in (ODOMETRY, JOINT_STATE)}
    turning = {namespace(t) for t, k in kinds.items() if k == IMU}
    if not scanning:
        return sorted(rolling & turning)
    both = (scanning & moving) - {""}
    # A scanner and an inertial unit in the root are shared; with wheels they are a robot.
    return sorted(both | ({""} if "" in scanning & rolling and both & rolling else set()))


def _weight(space: str, kinds: Mapping[str, str], counts: Mapping[str, int]) -> int:
    return sum(
        counts.get(t, 0)
        for t, k in kinds.items()
        if namespace(t) == space and k in (*_SCANS, *_MOTION)
    )


def _derived(topic: str, kind: str) -> bool:
    return any(part in topic.lower() for part in _DERIVED[kind])
