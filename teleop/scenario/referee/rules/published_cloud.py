"""Rule of the sweeps that the robot publishes: their points, and the distances to the map that colour them."""

from __future__ import annotations

import base64
from typing import Any, Final

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import Estimate, Pose, Sweep
from teleop.robot.tick_record import TickRecord
from teleop.scenario.referee.rules.lookalikes import nearest_on_map
from teleop.scenario.referee.rules.published_messages import Beliefs, stamp_of
from teleop.scenario.referee.rules.rule import Rule, RunFacts

_SAME: Final = 0.01
"""Difference of two distances from one surface at most [m]."""
_EXACT: Final = 1e-3
"""Tolerance of coordinates in single precision [m]."""
_CLEAR: Final = 0.03
"""Distance from a surface from which on the side on which a point lies is no matter of noise [m]."""
_NEAR: Final = 0.15
"""Distance from a surface up to which a point is judged [m]; beyond it belongs to something that is not mapped, and lies
before one face of a board's edge as well as behind the other."""
_FEWEST: Final = 20
"""Least number of points by which sides are judged."""
_AGREE: Final = 0.5
"""Share of them that lie on the side that is published, at least: thin walls have a surface on each side."""
_COLUMNS: Final = ("x", "y", "z", "intensity", "distance")
_FAR, _UNKNOWN = 254, 255
"""Distances of points that are too far from the map for a byte [cm], and of those near which nothing is mapped."""
_LEAN: Final = np.dtype([("place", "<i2", (3,)), ("distance", "u1")])


class CloudIsBelieved(Rule):
    """Clients receive the robot's own sweeps, where it believes to be."""

    name = "cloud"
    sentence = (
        "the points of `/local_cloud` and `/local_cloud/lean` are those of the sweep of their stamp, at the robot's "
        "estimate; their distances are those to the map, positive in front of a surface"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._beliefs = Beliefs()

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        self._beliefs.take(tick)
        for topic, message in self.facts.published.of("/local_cloud", "/local_cloud/lean"):
            believed = self._beliefs.of_sweep(stamp_of(message))
            if believed is None:
                return f"{topic} bears the stamp of no sweep of the last 10 s"
            if message["header"]["frame_id"] != "map":
                return f"{topic} is in {message['header']['frame_id']}"
            wrong = self._wrong(topic, message, believed)
            if wrong is not None:
                return f"{wrong} of {topic} are not those of the robot's sweep"
        return None

    def _wrong(self, topic: str, message: dict[str, Any], believed: Estimate) -> str | None:
        sweep, match, pose = believed.sweep, believed.match, believed.map_from_base
        if sweep is None or match is None or pose is None:
            return "the points"
        if topic.endswith("/lean"):
            return _wrong_lean(message, pose.apply(sweep.points), match.distances)
        wrong = _wrong_cloud(message, pose.apply(sweep.points), match.distances)
        right = wrong is not None or _on_their_sides(self.facts.cloud, sweep, pose, match.distances)
        return wrong if right else "the signs of the distances"


def _wrong_cloud(message: dict[str, Any], points: FloatArray, distances: FloatArray) -> str | None:
    if tuple(field["name"] for field in message["fields"]) != _COLUMNS:
        return "the fields"
    table = np.frombuffer(base64.b64decode(message["data"]), dtype="<f4")
    table = table.reshape(-1, len(_COLUMNS)).astype(float)
    if len(table) != len(points) or message["width"] != len(points):
        return "the numbers"
    if not np.allclose(table[:, :3], points, rtol=0.0, atol=_EXACT):
        return "the points"
    sent = table[:, 4]
    if not np.allclose(sent, distances, rtol=0.0, atol=_EXACT, equal_nan=True):
        return "the distances"
    return None


def _on_their_sides(cloud: Cloud, sweep: Sweep, pose: Pose, distances: FloatArray) -> bool:
    """Return whether most points that are clear of a surface are in front of it where their distance is positive.

    Points count whose nearest surface is the one that is meant: it faces the scanner, and is as far away.
    """
    away = np.abs(np.nan_to_num(distances))
    clear = np.flatnonzero((away > _CLEAR) & (away < _NEAR))
    points, origins = pose.apply(sweep.points[clear]), pose.apply(sweep.origins[clear])
    nearest = nearest_on_map(cloud, points)
    surfaces, normals = cloud.points[nearest], cloud.normals[nearest]
    heights = np.einsum("ij,ij->i", points - surfaces, normals)
    faces = np.einsum("ij,ij->i", origins - surfaces, normals) > 0.0
    meant = faces & (np.abs(np.abs(heights) - np.abs(distances[clear])) < _SAME)
    agrees = heights[meant] * distances[clear][meant] > 0.0
    return len(agrees) < _FEWEST or float(agrees.mean()) >= _AGREE


def _wrong_lean(message: dict[str, Any], points: FloatArray, distances: FloatArray) -> str | None:
    table = np.frombuffer(base64.b64decode(message["data"]), dtype=_LEAN)
    origin = np.array([message["origin"][axis] for axis in "xyz"], dtype=float)
    sent = origin + message["resolution"] * table["place"]
    if not len(sent) or not len(points):
        return "the numbers" if len(points) else None
    apart, index = cKDTree(points).query(sent)
    # A point is rounded along each axis to the nearest step.
    if apart.max() > 0.5 * np.sqrt(3.0) * message["resolution"] + _EXACT:
        return "the points"
    own = np.minimum(np.abs(100.0 * distances[index]), _FAR)
    own[np.isnan(own)] = _UNKNOWN
    # Of points that are rounded to the same place one is published.
    return None if (np.abs(own - table["distance"]) <= 2.0).mean() >= _AGREE else "the distances"
