"""Submaps of a few metres of a drive, and the alignment of sweeps with them, which measures drift.

Everything is in the plane: the horizontal scanner's points projected along gravity, in the axes of a levelled
``base_link``. A planar pose is (x, y, yaw); a planar covariance is that of these three.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from localization.geometry import FloatArray, wrap_angle
from localization.mapping.flat_sweep import FlatSweep
from localization.mapping.wall_lines import WallLines
from localization.mapping.window_search import scored_window
from localization.relocalization.refinement import best_places
from localization.relocalization.search_config import SearchConfig

_PEAKS = 8
"""Number of the best places of a search to which a sweep is aligned."""
_CLEARLY = 0.1
"""A pose is clearly better than another if it explains this share more of a sweep, or by ``_DECISIVE``."""
_DECISIVE = (2.0, 0.04)
"""Or if the other leaves so many times more unexplained, besides the share that noise leaves at any pose."""


@dataclass(frozen=True, slots=True)
class SubmapConfig:
    """Settings of submaps and of the alignment of sweeps."""

    spacing: float = 0.04
    """Edge of the cells in which points of one side of a wall are averaged [m]."""
    beams: int = 240
    """Number of points of a sweep that are aligned."""
    search_beams: int = 120
    """Number of points of a sweep that are laid over the submap's floor plan in a search."""
    sigma: float = 0.02
    """Distance of an inlier from its line, one sigma [m]."""
    kernel: float = 0.04
    """Geman-McClure scale at the end of the annealing [m]."""
    kernel_wide: float = 0.20
    """Geman-McClure scale at the beginning of the annealing [m]."""
    inlier: float = 0.08
    """Distance from its line up to which a point counts as inlier [m]."""
    effective_points: float = 60.0
    """A sweep informs like this many independent points at most: neighbouring beams have common errors."""
    normal_noise: float = 0.1
    """Angular noise of a normal, one sigma [rad]; the information that it seems to give along walls is removed."""
    iterations: int = 15
    """Number of iterations at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """Result of aligning a sweep with a submap."""

    pose: FloatArray
    """Planar pose (3,) of the sweep in the submap."""
    information: FloatArray
    """Information (3, 3) of the sweep on x, y (submap's axes) and yaw; zero in unobservable directions."""
    inlier_ratio: float
    """Fraction of the points that lie on the submap's walls, in [0, 1]."""


@dataclass(frozen=True, slots=True, eq=False)
class Submap:
    """Points on walls with normals towards the scanners that saw them."""

    points: FloatArray
    """Points (N, 2) [m]."""
    normals: FloatArray
    """Unit normals (N, 2)."""
    config: SubmapConfig
    """Settings."""
    _tree: cKDTree = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_tree", cKDTree(self.points))

    @classmethod
    def of(cls, sweeps: Sequence[FlatSweep], config: SubmapConfig = SubmapConfig()) -> Submap:
        """Return the submap of sweeps that are given in one frame."""
        walls = WallLines.joined([sweep.walls for sweep in sweeps]).averaged(config.spacing)
        return cls(walls.points, walls.normals, config)

    def align(self, sweep: FlatSweep, prior: FloatArray, covariance: FloatArray) -> Alignment:
        """Return the planar pose that agrees best with a sweep and a prediction.

        Args:
            sweep: Sweep to align.
            prior: Predicted planar pose (3,).
            covariance: Covariance (3, 3) of the prediction.
        """
        c = self.config
        sweep = sweep.thinned(c.beams)
        trust = np.linalg.inv(covariance)
        pose, kernel = np.array(prior, dtype=float), c.kernel_wide
        for _ in range(c.iterations):
            distance, rows = self._residuals(sweep, pose)
            hessian, gradient, _ = self._normal_equations(distance, rows, kernel)
            departure = pose - prior
            departure[2] = wrap_angle(departure[2])
            step = -np.linalg.solve(hessian + trust, gradient + trust @ departure)
            pose = pose + step
            if kernel <= c.kernel and float(np.abs(step).max()) < 1e-4:
                break
            kernel = max(c.kernel, 0.7 * kernel)
        pose[2] = wrap_angle(float(pose[2]))
        distance, rows = self._residuals(sweep, pose)
        hessian, gradient, weight = self._normal_equations(distance, rows, c.kernel)
        believed = hessian - c.normal_noise**2 * self._faked(sweep, weight, hessian)
        values, vectors = np.linalg.eigh(believed)
        information = (vectors * np.maximum(values, 0.0)) @ vectors.T
        fit = float((np.abs(distance) < c.inlier).mean()) if len(distance) else 0.0
        return Alignment(pose, information, fit)

    def _residuals(self, sweep: FlatSweep, pose: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return distances (N,) from the lines, infinite without a line that faces the beam, and the Jacobian."""
        at = sweep.moved(pose)
        gap, index = self._tree.query(at.points, distance_upper_bound=0.5)
        known = np.isfinite(gap)
        index = np.where(known, index, 0)
        normal = self.normals[index]
        distance = np.einsum("ni,ni->n", normal, at.points - self.points[index])
        facing = np.einsum("ni,ni->n", normal, at.origins - at.points) > 0.0
        # A line continues beyond the end of its wall: there, points have no distance.
        near = gap < np.abs(distance) + 2.0 * self.config.spacing
        distance = np.where(known & facing & near, distance, np.inf)
        arm = at.points - pose[:2]
        turn = normal[:, 1] * arm[:, 0] - normal[:, 0] * arm[:, 1]
        return distance, np.column_stack([normal, turn])

    def _normal_equations(
        self, distance: FloatArray, rows: FloatArray, kernel: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        c = self.config
        inside = np.abs(distance) < 3.0 * kernel
        gap = np.where(inside, distance, 0.0)
        weight = np.where(inside, (kernel**2 / (kernel**2 + gap**2)) ** 2, 0.0)
        total = float(weight.sum())
        weight *= min(1.0, c.effective_points / max(total, 1e-9)) / c.sigma**2
        weighted = rows * weight[:, None]
        return rows.T @ weighted, weighted.T @ gap, weight

    @staticmethod
    def _faked(sweep: FlatSweep, weight: FloatArray, hessian: FloatArray) -> FloatArray:
        """Return the spurious information of noisy normals along their walls (see ``registration``)."""
        total = np.zeros((3, 3))
        total[:2, :2] = weight.sum() * np.eye(2)
        total[2, 2] = float(weight @ np.square(sweep.points).sum(axis=1))
        return np.asarray(np.maximum(np.diag(total) - np.diag(hessian), 0.0) * np.eye(3))

    def search(
        self, sweep: FlatSweep, centre: FloatArray, half: float, half_yaw: float
    ) -> list[Alignment]:
        """Return the distinct poses of a window that explain a sweep, best first.

        Args:
            sweep: Sweep to align.
            centre: Planar pose (3,) at the centre of the window.
            half: Half width of the window in x and y [m].
            half_yaw: Half width of the window in yaw [rad].
        """
        c = SearchConfig()
        beams = sweep.thinned(self.config.search_beams).points
        turns = int(np.ceil(half_yaw / c.step_yaw))
        yaws = centre[2] + c.step_yaw * np.arange(-turns, turns + 1, dtype=np.float64)
        origin, likelihood = self._plan(c)
        scores, found_at = scored_window(
            beams, centre[:2], half, yaws, c.step, (origin, likelihood, c.cell)
        )
        peaks = best_places(scores, found_at[:, :2], found_at[:, 2], c, most=_PEAKS)
        loose = np.diag(np.square([c.step, c.step, c.step_yaw]))
        found = [self.align(sweep, np.array(peak), loose) for peak in peaks]
        found.sort(key=lambda a: -a.inlier_ratio)
        distinct: list[Alignment] = []
        for a in found:
            if not any(_same(a.pose, d.pose, c) for d in distinct):
                distinct.append(a)
        return distinct

    def _plan(self, c: SearchConfig) -> tuple[FloatArray, FloatArray]:
        """Return the likelihood field: the corner (2,) of its first cell [m] and its values (nx, ny)."""
        origin = self.points.min(axis=0) - 1.0
        shape = np.ceil((self.points.max(axis=0) + 1.0 - origin) / c.cell).astype(int) + 1
        empty = np.ones(tuple(shape), dtype=bool)
        empty[tuple(((self.points - origin) / c.cell).astype(int).T)] = False
        distance = ndimage.distance_transform_edt(empty) * c.cell
        return origin, np.exp(-0.5 * (distance / c.field_sigma) ** 2)


def unambiguous(places: Sequence[Alignment]) -> bool:
    """Return whether the best of several poses explains a sweep clearly better than the others."""
    if len(places) == 1:
        return True
    best, second = places[0].inlier_ratio, places[1].inlier_ratio
    factor, floor = _DECISIVE
    return best - second >= _CLEARLY or 1.0 - second >= factor * (1.0 - best) + floor


def _same(a: FloatArray, b: FloatArray, c: SearchConfig) -> bool:
    near = float(np.hypot(*(a - b)[:2])) < c.same_place
    return near and abs(wrap_angle(float(a[2] - b[2]))) < c.same_yaw
