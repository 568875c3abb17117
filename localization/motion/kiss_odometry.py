"""KISS-ICP at work: odometry of the horizontal scanner, and a second opinion against the cloud.

The only module that names ``kiss_icp``. Its parts are built from our own configuration, because the
package's reads environment variables; one thread, because only one is bit-exact, and the limit holds
for the process. It gets deskewed points and no time stamps: its own deskewing aborts the process when
all stamps are equal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from kiss_icp.mapping import VoxelHashMap
from kiss_icp.registration import Registration
from kiss_icp.voxelization import voxel_down_sample

from localization.errors import LocalizationError
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import Pose, Sweep


@dataclass(frozen=True, slots=True)
class KissConfig:
    """Settings of KISS-ICP's parts, chosen on the shipped scenes for planar scanners indoors.

    KISS-ICP's own defaults (Vizzo et al., RA-L 2023) are made for cars: voxels of 1 m and correspondences
    within several.
    """

    voxel: float = 0.2
    """Edge of the local and of the global map's voxels [m]."""
    points_per_voxel: int = 20
    """At most; KISS-ICP's default."""
    keypoint_spacing: float = 0.1
    """Voxel for thinning a sweep before it is aligned [m]."""
    odometry_range: float = 30.0
    """The local map forgets what is farther away [m]."""
    max_correspondence_distance: float = 0.5
    """Largest distance of corresponding points [m]."""
    kernel: float = 0.1
    """Geman-McClure scale [m]."""
    iterations: int = 60
    """At most."""
    convergence: float = 5e-4
    """A step shorter than this ends the alignment [m, rad together]."""
    point_noise: float = 0.02
    """Of a point against the local map, one sigma [m]."""
    piece_length: float = 0.15
    """Surfaces are looked at in pieces of this length [m]: over the few millimetres between the beams
    that meet a near wall, noise would have them face anywhere."""
    effective_points: float = 60.0
    """However many points, they inform like this many."""
    sigma_floor: float = 0.003
    """Floor of an increment's error, one sigma [m]."""
    sigma_floor_angle: float = np.deg2rad(0.1)
    """The same for yaw [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class KissView:
    """Where the odometry saw one sweep, in its local map."""

    place: object
    """The local map: each restart begins another."""
    pose: Pose
    points: FloatArray
    """(N, 3) that it added to the local map [m]."""
    covariance: FloatArray | None
    """(3, 3) of the motion since the sweep before; None of the first."""


@dataclass(frozen=True, slots=True, eq=False)
class KissSnapshot:
    """All that the odometry knows at one moment.

    KISS-ICP's local map itself cannot be copied, but its points can be read out, and added to an empty
    map they make the same one: each voxel gets the same points in the same order.
    """

    place: object
    pose: Pose
    ground: FloatArray
    """(N, 3) points of the local map some sweeps ago [m]."""
    layers: tuple[tuple[FloatArray, FloatArray], ...]
    """What each sweep since then added (N, 3) [m], and where the robot was (3,) [m]."""


_LAYERS = 10
"""Sweeps after which the local map is read out anew; that takes 0.1 to 0.5 ms."""
_NOTHING = np.zeros((0, 3))
_JUMP = 0.5
"""Neighbouring beams that end farther apart meet different surfaces [m]."""


class KissOdometry:
    """Follows the horizontal scanner from sweep to sweep, seeded by the wheels; x, y and yaw."""

    def __init__(self, config: KissConfig = KissConfig()) -> None:
        self.config = config
        self._map = VoxelHashMap(config.voxel, config.odometry_range, config.points_per_voxel)
        self._registration = _registration(config)
        self._pose = Pose.identity()
        self._place = object()
        self._ground: FloatArray = _NOTHING
        self._layers: tuple[tuple[FloatArray, FloatArray], ...] = ()
        self._stale = False
        self.view: KissView | None = None
        """Of the last sweep; None if there was nothing to see in it."""

    def add(self, sweep: Sweep, motion: Pose) -> tuple[Pose, FloatArray] | None:
        """Align a sweep with the local map.

        Args:
            sweep: points in ``base_link``; those of horizontal scanners are used.
            motion: predicted ``base_then_from_base_now`` since the last call.

        Returns:
            The observed motion (x, y, yaw) and its covariance (3, 3); None when there was nothing to
            align, or nothing to align with.
        """
        flat = sweep.points[sweep.horizontal] * [1.0, 1.0, 0.0]
        yaw = motion.yaw
        guess = self._pose @ Pose.planar(motion.position[0], motion.position[1], yaw)
        self.view = None
        if len(flat) < 30:
            self._pose = guess
            return None
        self._refresh()
        seen = None
        pose = guess
        if not self._map.empty():
            keypoints = np.asarray(voxel_down_sample(flat, self.config.keypoint_spacing))
            aligned = _align(self._registration, keypoints, self._map, guess, self.config)
            pose = Pose.planar(aligned.position[0], aligned.position[1], aligned.yaw)
            seen = (self._pose.inverse() @ pose, self._covariance(flat))
        thinned = np.asarray(voxel_down_sample(flat, 0.5 * self.config.voxel))
        covariance = None if seen is None else seen[1]
        self.view = KissView(self._place, pose, pose.apply(thinned), covariance)
        self._lay(self.view)
        self._map.add_points(self.view.points)
        self._map.remove_far_away_points(pose.position)
        if len(self._layers) == _LAYERS:
            self._ground, self._layers = np.array(self._map.point_cloud()), ()
        return seen

    def restart(self) -> None:
        """Forget where things were seen: the next sweep begins a new local map."""
        self._map.clear()
        self._place, self._ground, self._layers, self._stale = object(), _NOTHING, (), False

    def repeat(self, view: KissView) -> tuple[Pose, FloatArray] | None:
        """See a sweep again where it was seen before, without aligning it; return as ``add`` does.

        Raises:
            LocalizationError: if the view is not of this local map (see ``knows``).
        """
        if not self.knows(view):
            raise LocalizationError("a view can be repeated in its own local map only")
        before = self._pose
        self.view, self._stale = view, True
        self._lay(view)
        if view.covariance is None:
            return None
        return before.inverse() @ view.pose, view.covariance

    def knows(self, view: KissView) -> bool:
        """Return whether a view is one in the present local map."""
        return view.place is self._place

    def snapshot(self) -> KissSnapshot:
        """Return all that the odometry knows, for ``restore``."""
        return KissSnapshot(self._place, self._pose, self._ground, self._layers)

    def restore(self, snapshot: KissSnapshot) -> None:
        """Be as at a snapshot again: the same sweeps from there on give the same bits."""
        self._place, self._pose = snapshot.place, snapshot.pose
        self._ground, self._layers, self._stale = snapshot.ground, snapshot.layers, True
        self.view = None

    def _lay(self, view: KissView) -> None:
        self._pose = view.pose
        self._layers = (*self._layers, (view.points, view.pose.position))

    def _refresh(self) -> None:
        """Make KISS-ICP's local map anew if it is no longer that of the layers."""
        if not self._stale:
            return
        self._stale = False
        self._map.clear()
        self._map.add_points(self._ground)
        for points, centre in self._layers:
            self._map.add_points(points)
            self._map.remove_far_away_points(centre)
        if len(self._layers) >= _LAYERS:
            self._ground, self._layers = np.array(self._map.point_cloud()), ()

    def _covariance(self, flat: FloatArray) -> FloatArray:
        """What such a sweep can tell of x, y and yaw: its points hold it across their lines only.

        KISS-ICP gives no covariance, and point-to-point residuals would claim knowledge along a
        featureless wall (Bonnabel et al. 2014); the normals of neighbouring points do not.
        """
        c = self.config
        at, normal, count = _surface(flat[:, :2], c.piece_length)
        rows = np.column_stack([normal, at[:, 0] * normal[:, 1] - at[:, 1] * normal[:, 0]])
        share = min(1.0, c.effective_points / max(float(count.sum()), 1.0))
        information = (rows * count[:, None]).T @ rows * share / c.point_noise**2
        # A noisy normal informs along the wall too, falsely, and so does a wall that is not quite
        # straight: a tenth of the whole is not believed.
        believed = information - 0.1 * np.trace(information[:2, :2]) * np.diag([1.0, 1.0, 0.0])
        values, vectors = np.linalg.eigh(believed)
        safe = np.maximum(values, 1e-2)
        floor = np.diag(np.square([c.sigma_floor, c.sigma_floor, c.sigma_floor_angle]))
        covariance: FloatArray = (vectors / safe) @ vectors.T + floor
        return covariance


def _surface(flat: FloatArray, grain: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what a scan's points (N, 2), in the order of its beams, say of the surfaces they lie on.

    Args:
        flat: points [m].
        grain: length of a piece of surface [m].

    Returns:
        Middles (M, 2) [m] of pieces that have a neighbour on both sides, their normals (M, 2), and how
        many points (M,) each consists of.
    """
    steps = np.linalg.norm(np.diff(flat, axis=0), axis=1)
    # A longer step leads to another surface.
    jump = steps > _JUMP
    along = np.concatenate([[0.0], np.cumsum(np.where(jump, 0.0, steps))])
    surface = np.concatenate([[0], np.cumsum(jump)])
    # Far away, a step may be longer than a piece: what counts is the order of the pieces.
    _, piece = np.unique(np.column_stack([surface, along // grain]), axis=0, return_inverse=True)
    piece = piece.ravel()
    count = np.bincount(piece).astype(float)
    middle = np.column_stack([np.bincount(piece, flat[:, k]) / count for k in (0, 1)])
    of = np.zeros(len(count), dtype=int)
    of[piece] = surface
    inner = np.zeros(len(count), dtype=bool)
    inner[1:-1] = (of[2:] == of[1:-1]) & (of[:-2] == of[1:-1])
    across = middle[np.flatnonzero(inner) + 1] - middle[np.flatnonzero(inner) - 1]
    length = np.linalg.norm(across, axis=1, keepdims=True)
    across = across / np.maximum(length, 1e-9)
    return middle[inner], np.column_stack([-across[:, 1], across[:, 0]]), count[inner]


class KissOpinion:
    """Registers sweeps against the global cloud by point-to-point ICP, independent of our own matcher."""

    def __init__(self, cloud: Cloud, config: KissConfig = KissConfig()) -> None:
        self.config = config
        # No distance can cull this map; `update` is never called on it.
        self._map = VoxelHashMap(config.voxel, 1e9, config.points_per_voxel)
        # The binding wants an array that it could write to.
        self._map.add_points(np.array(cloud.points))
        self._registration = _registration(config)

    def locate(self, sweep: Sweep, guess: Pose) -> Pose | None:
        """Return ``map_from_base`` as KISS-ICP has it, starting from a guess; None without points."""
        if len(sweep.points) < 30:
            return None
        keypoints = np.asarray(
            voxel_down_sample(np.array(sweep.points), self.config.keypoint_spacing)
        )
        return _align(self._registration, keypoints, self._map, guess, self.config)


def _registration(config: KissConfig) -> Registration:
    return Registration(
        max_num_iterations=config.iterations,
        convergence_criterion=config.convergence,
        max_num_threads=1,
    )


def _align(
    registration: Registration,
    points: FloatArray,
    world: VoxelHashMap,
    guess: Pose,
    config: KissConfig,
) -> Pose:
    matrix = registration.align_points_to_map(
        points, world, _matrix(guess), config.max_correspondence_distance, config.kernel
    )
    return Pose.from_rotation(matrix[:3, 3], matrix[:3, :3])


def _matrix(pose: Pose) -> FloatArray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose.rotation, pose.position
    return matrix
