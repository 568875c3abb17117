"""Messages about the robot's estimate and its hints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from localization.filter.covariance import horizontal_sigma
from localization.geometry import FloatArray
from localization.logs.ros_geometry import pose_to_dict, transform_to_dict, vector_to_dict
from localization.maps.cloud import Cloud
from localization.types import Estimate, Mounts, Pose
from teleop.robot.tick_record import EstimateRecord
from teleop.robot.topics.message_parts import Message, Messages, header, odometry, point_cloud


def ros_covariance(estimate: Estimate) -> FloatArray:
    """Return the (36,) covariance in ROS's convention, whose rotations are about the fixed axes."""
    assert estimate.map_from_base is not None
    turn = np.eye(6)
    turn[3:, 3:] = estimate.map_from_base.rotation
    return np.asarray((turn @ estimate.covariance @ turn.T).ravel())


def tf(tick: EstimateRecord) -> Messages:
    """Return ``map`` to ``odom``, once the robot is localised, and ``odom`` to ``base_link``."""
    e = tick.estimate
    transforms = [_transform(tick.stamp, "odom", "base_link", e.odom_from_base)]
    if e.map_from_base is not None:
        map_from_odom = e.map_from_base @ e.odom_from_base.inverse()
        transforms.insert(0, _transform(tick.stamp, "map", "odom", map_from_odom))
    return ({"transforms": transforms},)


def tf_static(mounts: Mounts) -> Message:
    """Return the transforms from ``base_link`` to each sensor."""
    transforms = [_transform(0, "base_link", name, pose) for name, pose in mounts.items()]
    return {"transforms": transforms}


def map_info(cloud: Cloud, run_id: str, places: Mapping[str, Pose]) -> Message:
    """Return name, bounds, hash and named places of the map, and the identity of this run of the robot."""
    low, high = cloud.bounds
    return {
        "name": cloud.name,
        "frame_id": cloud.frame,
        "sha256": cloud.sha256,
        "points": len(cloud.points),
        "min": vector_to_dict(low),
        "max": vector_to_dict(high),
        "run_id": run_id,
        "place_names": list(places),
        "places": [pose_to_dict(pose) for pose in places.values()],
    }


def odom(tick: EstimateRecord) -> Messages:
    """Return the dead-reckoned pose in ``odom`` and the estimated twist."""
    estimate = tick.estimate
    return (odometry(tick.stamp, "odom", estimate.odom_from_base, estimate.twist),)


def amcl_pose(tick: EstimateRecord) -> Messages:
    """Return the estimate in ``map`` with its covariance, once there is one."""
    pose = tick.estimate.map_from_base
    if pose is None:
        return ()
    covariance = ros_covariance(tick.estimate)
    return (
        {
            "header": header(tick.stamp, "map"),
            "pose": {"pose": pose_to_dict(pose), "covariance": covariance},
        },
    )


def local_cloud(tick: EstimateRecord) -> Messages:
    """Return the last registered sweep in ``map``, with each point's distance to the map."""
    e = tick.estimate
    if e.sweep is None or e.match is None or e.map_from_base is None:
        return ()
    table = np.zeros((len(e.sweep.points), 5), dtype="<f4")
    table[:, :3] = e.map_from_base.apply(e.sweep.points)
    table[:, 4] = e.match.distances
    names = ("x", "y", "z", "intensity", "distance")
    dense = bool(np.isfinite(table).all())
    return (point_cloud(e.sweep.stamp, "map", names, table.tobytes(), dense=dense),)


def thinner_cloud(cloud: Message, share: float) -> Message:
    """Return a cloud with a share of its points, 0 to 1, evenly spaced in their order, which is that of the beams."""
    step, count = cloud["point_step"], cloud["width"]
    kept = max(round(count * share), min(count, 1))
    points = np.frombuffer(cloud["data"], dtype=f"V{step}")
    data = points[np.arange(kept) * count // max(kept, 1)].tobytes()
    return {**cloud, "width": kept, "row_step": step * kept, "data": data}


def localization_status(tick: EstimateRecord) -> Messages:
    """Return health with its reasons, and figures of the last registration."""
    e = tick.estimate
    placed = e.map_from_base is not None
    return (
        {
            "header": header(tick.stamp, "map"),
            "health": e.health.value,
            "reasons": list(e.reasons),
            "fit": tick.fit or 0.0,
            "nis": tick.nis or 0.0,
            "position_sigma": horizontal_sigma(e.covariance) if placed else 0.0,
            "heading_sigma": float(np.sqrt(e.covariance[5, 5])) if placed else 0.0,
            "unexplained": 0.0 if tick.fit is None else 1.0 - tick.fit,
            "candidate_scores": [c.score for c in e.hypotheses],
        },
    )


def hint_verdict(tick: EstimateRecord) -> Messages:
    """Return the verdict about a hint, if one was reached in the tick."""
    found = [e.verdict for e in tick.estimates if e.verdict is not None]
    if not found:
        return ()
    verdict = found[-1]
    return (
        {
            "header": header(verdict.stamp, "map"),
            "verdict": verdict.verdict.value,
            "reason": verdict.reason,
            "hint": pose_to_dict(verdict.hint.map_from_base),
            "candidates": [pose_to_dict(c.map_from_base) for c in verdict.candidates],
            "scores": [c.score for c in verdict.candidates],
        },
    )


def candidates(tick: EstimateRecord) -> Messages:
    """Return the places between which the search has not decided yet, best first."""
    poses = [pose_to_dict(c.map_from_base) for c in tick.estimate.hypotheses]
    return ({"header": header(tick.stamp, "map"), "poses": poses},)


def _transform(stamp: int, parent: str, child: str, pose: Pose) -> Message:
    return {
        "header": header(stamp, parent),
        "child_frame_id": child,
        "transform": transform_to_dict(pose),
    }
