"""How far a map made without truth can be trusted: its loops, its own noise, and the drift that remains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray
from localization.mapping.loop_closure_types import Closure
from localization.mapping.pose_graph import SolvedGraph

_SAMPLES = 40
"""Number of key frames at which the posterior is evaluated: each takes a solution of the whole graph."""
_BESIDE = 3.0
"""Two key frames nearer than this see the same walls [m]."""
_LATER = 10.0
"""Way between two visits, and between key frames that are compared where there is no other visit [m]."""
_BELIEVED = 0.25
"""Weight of a closure in the graph from which on it counts."""
_ONE_LOOP = 5.0
"""Closures whose visits are nearer than this along the drive are one loop [m]."""
_WAY_PER_LOOP = 100.0
"""Way for which a map should have one loop at least [m]; real odometry drifts by about a metre over it."""
_SHORT = 30.0
"""Drives shorter than this need no loop [m]."""


@dataclass(frozen=True, slots=True)
class MapAccuracy:
    """Estimated accuracy of a map made without truth."""

    distance: float
    """Length of the drive [m]."""
    closures: int
    """Number of closures that the pose graph believes."""
    loops: int
    """Number of separate loops among them: stretches of the drive that were visited again."""
    position_noise: float
    """Error of the map's parts relative to what lies beside them, one sigma along each axis [m]."""
    heading_noise: float
    """The same of their heading, one sigma [rad]."""
    drift: float
    """Largest error of a key frame relative to the first, one sigma [m]."""
    drift_heading: float
    """Largest error of its heading, one sigma [rad]."""

    def lines(self) -> tuple[str, ...]:
        """Return the report: how many loops there are, how far to trust the map, and a warning if there is one."""
        report = (
            f"{self.distance:.0f} m driven, {self.loops} loops closed by {self.closures} closures",
            f"estimated accuracy, one sigma: {100 * self.position_noise:.1f} cm and "
            f"{np.rad2deg(self.heading_noise):.2f} deg among neighbouring walls, {self.drift:.2f} m and "
            f"{np.rad2deg(self.drift_heading):.1f} deg from one end of the drive to the other",
        )
        warning = self.warning
        return report if warning is None else (*report, warning)

    @property
    def warning(self) -> str | None:
        """One line if the loops are too few to trust the map's shape."""
        if self.distance < _SHORT or self.loops * _WAY_PER_LOOP >= self.distance:
            return None
        loops = {0: "no loop", 1: "only one loop"}.get(self.loops, f"only {self.loops} loops")
        return (
            f"{loops} in {self.distance:.0f} m: the map may be bent by metres where no loop holds it; drive so that "
            "places are visited again, and end where you began"
        )


def map_accuracy(
    graph: SolvedGraph, way: FloatArray, closures: Sequence[Closure], held: float = 0.0
) -> MapAccuracy:
    """Return the accuracy that a solved pose graph claims, with the closures' own errors.

    If the closures disagree with the graph by more than their covariances, all covariances are scaled up to agree.

    Args:
        graph: The graph; its last edges are the closures.
        way: Distance driven (K,) up to each key frame [m].
        closures: The closures.
        held: Least noise of the positions [m].
    """
    count = len(closures)
    first = len(graph.errors) - count
    believed = graph.weights[first:] >= _BELIEVED
    errors = graph.errors[first:][believed]
    kept = [k for k, b in zip(closures, believed.tolist(), strict=True) if b]
    scale, off, off_yaw = 1.0, 0.0, 0.0
    if len(errors):
        trust = np.linalg.inv(np.array([k.covariance for k in kept]))
        scale = max(1.0, float(np.einsum("ei,eij,ej->e", errors, trust, errors).mean()) / 3.0)
        off = float(np.sqrt(0.5 * np.square(errors[:, :2]).sum(axis=1).mean()))
        off_yaw = float(np.sqrt(np.square(errors[:, 2]).mean()))
    pairs = _pairs(graph.poses, way)
    columns = {k: graph.covariance_columns(k) for k in {n for pair in pairs for n in pair}}
    relative = np.array([_relative(graph.poses, columns, *pair) for pair in pairs])
    near = scale * relative.mean(axis=0) if len(pairs) else np.zeros(3)
    own = np.array([columns[k][k] for k in columns])
    drift = np.sqrt(scale * np.linalg.eigvalsh(own[:, :2, :2])[:, -1].max()) if len(own) else 0.0
    drift_yaw = np.sqrt(scale * own[:, 2, 2].max()) if len(own) else 0.0
    return MapAccuracy(
        distance=float(way[-1]),
        closures=len(kept),
        loops=_loops(way, kept),
        position_noise=max(held, off, float(np.sqrt(0.5 * (near[0] + near[1])))),
        heading_noise=max(off_yaw, float(np.sqrt(near[2]))),
        drift=float(drift),
        drift_heading=float(drift_yaw),
    )


def _pairs(poses: FloatArray, way: FloatArray) -> list[tuple[int, int]]:
    """Return pairs of key frames beside each other: two visits where there were two, else ten metres apart."""
    samples = np.unique(np.linspace(1, len(poses) - 1, min(_SAMPLES, len(poses) - 1)).astype(int))
    pairs = []
    for later in samples.tolist():
        before = np.flatnonzero(way[: later + 1] <= way[later] - _LATER)
        distance = np.hypot(*(poses[before, :2] - poses[later, :2]).T)
        again = before[distance < _BESIDE]
        earlier = again[0] if len(again) else before[-1] if len(before) else 0
        pairs.append((int(earlier), later))
    return pairs


def _relative(
    poses: FloatArray, columns: dict[int, FloatArray], earlier: int, later: int
) -> FloatArray:
    """Return the variances (3,) of x, y and yaw of one key frame in another's axes."""
    c, s = np.cos(poses[earlier, 2]), np.sin(poses[earlier, 2])
    back = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    x, y = poses[later, :2] - poses[earlier, :2]
    swing = np.eye(3)
    # The earlier one's heading moves what lies beside it.
    swing[:2, 2] = [-y, x]
    first, second = back @ swing, back
    cross = first @ columns[later][earlier] @ second.T
    covariance = first @ columns[earlier][earlier] @ first.T
    covariance = covariance + second @ columns[later][later] @ second.T - cross - cross.T
    variances: FloatArray = np.maximum(np.diag(covariance), 0.0)
    return variances


def _loops(way: FloatArray, closures: Sequence[Closure]) -> int:
    """Return the number of groups of closures whose visits follow each other along the drive."""
    if not closures:
        return 0
    at = np.array([(way[k.later], way[k.earlier]) for k in closures])
    at = at[np.argsort(at[:, 0], kind="stable")]
    groups: list[FloatArray] = []
    for visit in at:
        near = [g for g, last in enumerate(groups) if np.abs(visit - last).max() < _ONE_LOOP]
        if near:
            groups[near[-1]] = visit
        else:
            groups.append(visit)
    return len(groups)
