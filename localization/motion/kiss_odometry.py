"""Laser odometry by KISS-ICP: tracks the horizontal scanner from sweep to sweep, seeded by the wheels."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from localization.errors import LocalizationError
from localization.geometry import FloatArray
from localization.motion.alignment_covariance import alignment_covariance
from localization.motion.kiss_icp import (
    FEWEST_POINTS,
    POINTS_PER_VOXEL,
    KissAligner,
    KissConfig,
    VoxelHashMap,
    thinned,
)
from localization.types import Pose, Sweep

ObservedMotion = tuple[Pose, FloatArray]
"""Motion ``base_then_from_base_now`` (x, y, yaw) since the sweep before, and its covariance (3, 3) [m, m, rad]."""

_CONSOLIDATE_AFTER = 10
"""The points of the local map are read out again after this many sweeps; that takes 0.1 to 0.5 ms."""
_NOTHING = np.zeros((0, 3))
_NOTHING.flags.writeable = False

_Layer = tuple[FloatArray, FloatArray]
"""Points that a sweep added (N, 3) [m], and where the robot was (3,) [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class KissState:
    """Everything that the odometry knows at one moment.

    KISS-ICP's local map itself cannot be copied. But its points can be read out, and added to an empty map
    they make the same one, for each voxel gets the same points in the same order.
    """

    map_id: object = field(default_factory=object)
    """Identity of the local map; each restart begins another."""
    pose: Pose = field(default_factory=Pose.identity)
    """Pose of the robot in the local map."""
    base: FloatArray = field(default_factory=lambda: _NOTHING)
    """(N, 3) points of the local map some sweeps ago [m]."""
    layers: tuple[_Layer, ...] = ()
    """What each sweep since then has added."""

    def restarted(self) -> KissState:
        """Return the state without a local map: the next sweep begins another."""
        return KissState(pose=self.pose)


@dataclass(frozen=True, slots=True, eq=False)
class KissView:
    """Where the odometry observed one sweep, in its local map."""

    map_id: object
    """Identity of the local map."""
    pose: Pose
    """Pose of the robot in the local map."""
    points: FloatArray
    """(N, 3) points that the sweep added to the local map [m]."""
    covariance: FloatArray | None
    """(3, 3) covariance of the motion since the sweep before; None for the first."""


class KissOdometry:
    """Steps of the odometry; what it remembers is in ``KissState``.

    It keeps KISS-ICP's map of the state that it computed last, and builds it again when it is asked to go
    on from another: that costs time and changes no result.
    """

    def __init__(self, config: KissConfig = KissConfig()) -> None:  # noqa: B008  (frozen)
        self.config = config
        self._aligner = KissAligner(config)
        self._voxels = VoxelHashMap(config.voxel, config.odometry_range, POINTS_PER_VOXEL)
        self._held = KissState()

    def add(
        self, state: KissState, sweep: Sweep, motion: Pose
    ) -> tuple[KissState, ObservedMotion | None, KissView | None]:
        """Align a sweep with the local map.

        Args:
            state: before the sweep.
            sweep: points in ``base_link``; those of horizontal scanners are used.
            motion: predicted ``base_then_from_base_now`` since the sweep before.

        Returns:
            The state after it; the observed motion, None if there was nothing to align or to align with;
            and the view of the sweep, for ``repeat``, None if it has too few points.
        """
        c = self.config
        flat = sweep.points[sweep.horizontal] * [1.0, 1.0, 0.0]
        guess = state.pose @ Pose.planar(motion.position[0], motion.position[1], motion.yaw)
        if len(flat) < FEWEST_POINTS:
            return replace(state, pose=guess), None, None
        state = self._with_map_of(state)
        pose, observed, covariance, few = guess, None, None, thinned(flat, c)
        if not self._voxels.empty():
            aligned = self._aligner.align(few, self._voxels, guess)
            pose = Pose.planar(aligned.position[0], aligned.position[1], aligned.yaw)
            if strayed(guess, pose, c):
                return KissState(pose=guess), None, None
            covariance = alignment_covariance(flat, c)
            observed = (state.pose.inverse() @ pose, covariance)
        added = pose.apply(few)
        view = KissView(state.map_id, pose, added, covariance)
        state = _with_layer(state, view)
        self._voxels.add_points(added)
        self._voxels.remove_far_away_points(pose.position)
        self._held = self._consolidated(state, full=len(state.layers) == _CONSOLIDATE_AFTER)
        return self._held, observed, view

    def repeat(self, state: KissState, view: KissView) -> tuple[KissState, ObservedMotion | None]:
        """Observe a sweep again where it was observed before, without aligning it.

        Raises:
            LocalizationError: if the view is not one in this local map.
        """
        if view.map_id is not state.map_id:
            raise LocalizationError("a view can be repeated in its own local map only")
        after = _with_layer(state, view)
        if view.covariance is None:
            return after, None
        return after, (state.pose.inverse() @ view.pose, view.covariance)

    def _with_map_of(self, state: KissState) -> KissState:
        """Make KISS-ICP's map that of a state; return the state, its points read out anew if it has many layers."""
        if state.layers is self._held.layers and state.base is self._held.base:
            return state
        self._voxels.clear()
        self._voxels.add_points(np.array(state.base))
        for points, centre in state.layers:
            self._voxels.add_points(points)
            self._voxels.remove_far_away_points(centre)
        return self._consolidated(state, full=len(state.layers) >= _CONSOLIDATE_AFTER)

    def _consolidated(self, state: KissState, *, full: bool) -> KissState:
        """Return the state with the points of KISS-ICP's map as its base, if it has many layers."""
        if not full:
            return state
        return replace(state, base=np.array(self._voxels.point_cloud()), layers=())


def strayed(guess: Pose, pose: Pose, config: KissConfig) -> bool:
    """Return whether an alignment ended farther from its guess than points can find their counterparts."""
    off = guess.inverse() @ pose
    return float(np.hypot(*off.position[:2])) > config.max_correspondence_distance


def _with_layer(state: KissState, view: KissView) -> KissState:
    layers = (*state.layers, (view.points, view.pose.position))
    return KissState(state.map_id, view.pose, state.base, layers)
