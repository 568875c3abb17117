"""Knots of a drive: the places between which its correction is interpolated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray, wrap_angle
from localization.mapping.cloud_builder import MappingConfig
from localization.mapping.odometry_front_end import OdometrySweep
from localization.mapping.planar_pose import between, compose
from localization.types import IntArray


@dataclass(frozen=True, slots=True)
class RefinementConfig:
    """Settings of the refinement."""

    rounds: int = 2
    """Number of times that planes are built and the drive is corrected; a third round moves no knot of an office
    by more than a millimetre. Zero disables the refinement."""
    knot_distance: float = 0.25
    """A knot, at which the drive may bend, is made after the robot has moved this far [m]."""
    knot_turn: float = np.deg2rad(10.0)
    """A knot is also made after the robot has turned by this angle [rad]."""
    sigma: float = 0.02
    """Distance of an inlier from its plane, one sigma [m]."""
    kernel: float = 0.04
    """Geman-McClure scale [m]; points three times as far are on another surface."""
    reach: float = 0.12
    """Greatest distance of a point from its plane's centre along the plane [m]."""
    edge: tuple[float, float, float] = (0.003, 0.003, np.deg2rad(0.05))
    """Error of wheels and gyro from knot to knot, one sigma: horizontal [m], vertical [m], heading [rad]."""
    level: bool = True
    """Whether the ground is level; heights then stay fixed."""
    mapping: MappingConfig = field(default_factory=lambda: MappingConfig(raw_spacing=0.04))
    """Settings of the planes: points are averaged coarser than in a finished cloud, which halves the time."""


@dataclass(frozen=True, slots=True, eq=False)
class DriveKnots:
    """Knots of a drive, and the position of each sweep between them."""

    steps: Sequence[OdometrySweep]
    """The N sweeps with their odometry."""
    config: RefinementConfig
    """Settings."""
    knots: IntArray
    """Numbers of the sweeps at knots (K,), the first and the last sweep among them."""
    segment: IntArray
    """Number of the knot before each sweep (N,)."""
    share: FloatArray
    """Position of each sweep between its two knots (N,), in [0, 1]."""

    @classmethod
    def of(cls, steps: Sequence[OdometrySweep], config: RefinementConfig) -> DriveKnots:
        """Choose the knots of a drive."""
        knots = [0]
        for i, step in enumerate(steps):
            way = between(steps[knots[-1]].rolled, step.rolled)
            far = float(np.hypot(way[0], way[1])) > config.knot_distance
            if far or abs(float(way[2])) > config.knot_turn:
                knots.append(i)
        last = len(steps) - 1
        if knots[-1] != last:
            knots.append(last)
        at = np.array(knots)
        every = np.arange(len(steps))
        segment = np.clip(np.searchsorted(at, every, side="right") - 1, 0, len(at) - 2)
        share = (every - at[segment]) / (at[segment + 1] - at[segment])
        return cls(steps, config, at, segment, share)

    def smoothed(self, trajectory: Trajectory) -> FloatArray:
        """Return x, y, z and yaw (N, 4): those of the trajectory at knots, interpolated by wheels and gyro between.

        This removes KISS-ICP's noise of some millimetres from sweep to sweep.
        """
        poses = [trajectory.pose(i) for i in range(len(self.steps))]
        places = np.array([[*p.position, p.yaw] for p in poses])
        planar = places[:, [0, 1, 3]]
        smooth = places.copy()
        for i, (k, share) in enumerate(
            zip(self.segment.tolist(), self.share.tolist(), strict=True)
        ):
            before, after = (
                compose(planar[knot], between(self.steps[knot].rolled, self.steps[i].rolled))
                for knot in self.knots[k : k + 2].tolist()
            )
            turn = wrap_angle(float(after[2] - before[2]))
            smooth[i, :2] = before[:2] + share * (after - before)[:2]
            smooth[i, 3] = before[2] + share * turn
        return smooth

    def spread(self, correction: FloatArray) -> FloatArray:
        """Return the correction (N, 4) of each step, given those of the knots (K, 4)."""
        share = self.share[:, None]
        spread: FloatArray = (1.0 - share) * correction[self.segment]
        return spread + share * correction[self.segment + 1]
