"""Floor plans of a few metres of way, and sweeps laid over them: what drift is measured by.

All of it is in the plane: the horizontal scanner's points as seen from above, in the axes of a levelled
``base_link``. A planar pose is (x, y, yaw), a planar covariance is of those three.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from localization.geometry import FloatArray, rotation_from_euler, wrap_angle
from localization.relocalization.refinement import best_places
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.verification import distinguishable
from localization.types import Sweep


@dataclass(frozen=True, slots=True)
class SubmapConfig:
    """How floor plans are made and sweeps laid over them."""

    spacing: float = 0.04
    """Points of one side of a wall nearer than this are averaged [m]."""
    normal_radius: float = 0.12
    """Neighbourhood of a normal [m]: less than the thinnest wall, so that its two faces stay apart."""
    beams: int = 240
    """Points of a sweep that are laid over a plan."""
    sigma: float = 0.02
    """Distance of a true point from its line, one sigma [m]."""
    kernel: float = 0.04
    """Geman-McClure scale at the end of the annealing [m]."""
    kernel_wide: float = 0.20
    """Scale at its beginning [m]."""
    inlier: float = 0.08
    """A point this near to its line counts as explained [m]."""
    effective_points: float = 60.0
    """Neighbouring beams err together: however many points, they inform like this many."""
    normal_noise: float = 0.1
    """Angular noise of a normal, one sigma [rad]: what it fakes along a wall is not believed."""
    iterations: int = 15


@dataclass(frozen=True, slots=True, eq=False)
class FlatSweep:
    """Points of the horizontal scanner as seen from above, in the levelled ``base_link``."""

    points: FloatArray
    """(N, 2) [m]."""
    origins: FloatArray
    """(N, 2), where the beam of each began [m]."""

    @classmethod
    def of(cls, sweep: Sweep, roll: float, pitch: float) -> FlatSweep:
        """Look at a sweep from above, given how the robot stood [rad]; ground is left out."""
        upright = levelled(sweep, roll, pitch)
        kept = upright.horizontal
        return cls(upright.points[kept, :2], upright.origins[kept, :2])

    @classmethod
    def joined(cls, sweeps: Sequence[FlatSweep]) -> FlatSweep:
        """Return several as one."""
        return cls(
            np.concatenate([s.points for s in sweeps]), np.concatenate([s.origins for s in sweeps])
        )

    def moved(self, pose: FloatArray) -> FlatSweep:
        """Return it as it is seen from where its robot is at a planar pose (3,)."""
        return FlatSweep(moved(pose, self.points), moved(pose, self.origins))

    def thinned(self, most: int) -> FlatSweep:
        """Return at most so many points, evenly chosen."""
        n = len(self.points)
        chosen = np.linspace(0, n - 1, min(most, n)).astype(int)
        return FlatSweep(self.points[chosen], self.origins[chosen])


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """Where a sweep came to lie on a submap."""

    pose: FloatArray
    """(3,) planar pose of the sweep's robot in the submap."""
    information: FloatArray
    """(3, 3) of x, y (submap's axes) and yaw, the sweep's alone; zero where nothing was seen."""
    fit: float
    """Share of the points that lie on the plan, in [0, 1]."""


@dataclass(frozen=True, slots=True, eq=False)
class Submap:
    """Points on walls with normals towards where they were seen from."""

    points: FloatArray
    """(N, 2) [m]."""
    normals: FloatArray
    """(N, 2), unit."""
    config: SubmapConfig
    _tree: cKDTree = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_tree", cKDTree(self.points))

    @classmethod
    def of(cls, sweeps: Sequence[FlatSweep], config: SubmapConfig = SubmapConfig()) -> Submap:
        """Average sweeps that were moved to one frame."""
        every = FlatSweep.joined(sweeps)
        points, view = every.points, every.origins - every.points
        view /= np.maximum(np.linalg.norm(view, axis=1, keepdims=True), 1e-9)
        points, view = _averaged(points, view, config.spacing)
        normals, good = _normals(points, view, config.normal_radius)
        return cls(points[good], normals[good], config)

    def align(self, sweep: FlatSweep, prior: FloatArray, covariance: FloatArray) -> Alignment:
        """Find the planar pose that reconciles a prediction (3,), its covariance (3, 3) and a sweep."""
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
        """Distances (N,) from the lines, infinite where there is none that faces the beam; Jacobian."""
        at = sweep.moved(pose)
        gap, index = self._tree.query(at.points, distance_upper_bound=0.5)
        known = np.isfinite(gap)
        index = np.where(known, index, 0)
        normal = self.normals[index]
        distance = np.einsum("ni,ni->n", normal, at.points - self.points[index])
        facing = np.einsum("ni,ni->n", normal, at.origins - at.points) > 0.0
        # Beyond the end of a wall its line goes on, the wall does not.
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
        """Information that noisy normals seem to give along their walls (see ``registration``)."""
        total = np.zeros((3, 3))
        total[:2, :2] = weight.sum() * np.eye(2)
        total[2, 2] = float(weight @ np.square(sweep.points).sum(axis=1))
        return np.asarray(np.maximum(np.diag(total) - np.diag(hessian), 0.0) * np.eye(3))

    def search(
        self, sweep: FlatSweep, centre: FloatArray, half: float, half_yaw: float
    ) -> list[Alignment]:
        """Try every pose of a window and return the distinct places found, best first.

        Args:
            sweep: what was seen.
            centre: (3,) planar pose in the middle of the window.
            half: its half width in x and y [m].
            half_yaw: the same for yaw [rad].
        """
        c = SearchConfig()
        beams = sweep.thinned(c.beams).points
        steps = np.arange(-np.ceil(half / c.step), half / c.step + 1) * c.step
        places = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
        places = places + centre[:2]
        turns = int(np.ceil(half_yaw / c.step_yaw))
        yaws = centre[2] + c.step_yaw * np.arange(-turns, turns + 1, dtype=np.float64)
        origin, likelihood = self._plan(c)
        scores = np.array(
            [_scores(moved(np.array([0.0, 0.0, yaw]), beams), places, origin, likelihood, c.cell)
             for yaw in yaws]
        )  # fmt: skip
        heading, place = np.divmod(np.arange(scores.size), len(places))
        peaks = best_places(scores.ravel(), places[place], yaws[heading], c, most=c.refine)
        loose = np.diag(np.square([c.step, c.step, c.step_yaw]))
        found = [self.align(sweep, np.array(peak), loose) for peak in peaks]
        found.sort(key=lambda a: -a.fit)
        distinct: list[Alignment] = []
        for a in found:
            if not any(_same(a.pose, d.pose, c) for d in distinct):
                distinct.append(a)
        return distinct

    def _plan(self, c: SearchConfig) -> tuple[FloatArray, FloatArray]:
        """Lay out how near each cell is to a wall; return its first corner (2,) and scores (nx, ny)."""
        origin = self.points.min(axis=0) - 1.0
        shape = np.ceil((self.points.max(axis=0) + 1.0 - origin) / c.cell).astype(int) + 1
        empty = np.ones(tuple(shape), dtype=bool)
        empty[tuple(((self.points - origin) / c.cell).astype(int).T)] = False
        distance = ndimage.distance_transform_edt(empty) * c.cell
        return origin, np.exp(-0.5 * (distance / c.field_sigma) ** 2)


def levelled(sweep: Sweep, roll: float, pitch: float) -> Sweep:
    """Return the horizontal scanner's points in the levelled ``base_link``, those on the ground left out.

    A beam that came down to half its scanner's height has met the ground, or soon will: a tilted robot
    would take that for a wall.
    """
    level = rotation_from_euler(roll, pitch, 0.0).T
    points, origins = sweep.points @ level, sweep.origins @ level
    kept = sweep.horizontal & (points[:, 2] >= 0.5 * np.minimum(origins[:, 2], sweep.origins[:, 2]))
    return Sweep(sweep.stamp, points[kept], origins[kept], sweep.horizontal[kept])


def unambiguous(places: Sequence[Alignment]) -> bool:
    """Return whether the best of several places explains a sweep clearly better than the others."""
    c = SearchConfig()
    return len(places) == 1 or distinguishable(places[0].fit, places[1].fit, c)


def moved(pose: FloatArray, points: FloatArray) -> FloatArray:
    """Map points (N, 2) by a planar pose (3,)."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    turned: FloatArray = points @ np.array([[c, s], [-s, c]]) + pose[:2]
    return turned


def compose(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return planar pose (3,) ``a`` followed by ``b``, seen from ``a``."""
    x, y = moved(a, b[None, :2])[0]
    return np.array([x, y, wrap_angle(float(a[2] + b[2]))])


def between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return planar pose ``b`` (3,) as seen from ``a``."""
    c, s = np.cos(a[2]), np.sin(a[2])
    x, y = b[:2] - a[:2]
    return np.array([c * x + s * y, c * y - s * x, wrap_angle(float(b[2] - a[2]))])


def _same(a: FloatArray, b: FloatArray, c: SearchConfig) -> bool:
    near = float(np.hypot(*(a - b)[:2])) < c.same_place
    return near and abs(wrap_angle(float(a[2] - b[2]))) < c.same_yaw


def _scores(
    beams: FloatArray, places: FloatArray, origin: FloatArray, likelihood: FloatArray, cell: float
) -> FloatArray:
    at = ((places[:, None, :] + beams[None, :, :] - origin) / cell).astype(np.int64)
    at = np.clip(at, 0, np.array(likelihood.shape) - 1)
    score: FloatArray = likelihood[at[..., 0], at[..., 1]].mean(axis=1)
    return score


def _averaged(
    points: FloatArray, view: FloatArray, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Average points and their views per cell, apart for each quarter they are seen from."""
    cell = np.floor(points / spacing).astype(np.int64)
    cell -= cell.min(axis=0)
    quarter = np.floor((np.arctan2(view[:, 1], view[:, 0]) + np.pi) / (0.5 * np.pi))
    width = int(cell[:, 1].max()) + 1
    key = (cell[:, 0] * width + cell[:, 1]) * 5 + quarter.astype(np.int64)
    _, inverse, count = np.unique(key, return_inverse=True, return_counts=True)
    mean = [np.bincount(inverse, column) / count for column in (*points.T, *view.T)]
    return np.column_stack(mean[:2]), np.column_stack(mean[2:])


def _normals(
    points: FloatArray, view: FloatArray, radius: float
) -> tuple[FloatArray, np.typing.NDArray[np.bool_]]:
    """Return normals (N, 2) of lines through neighbours, towards the viewer, and which are of lines."""
    distance, index = cKDTree(points).query(points, k=12, distance_upper_bound=radius)
    near = np.isfinite(distance)
    index = np.where(near, index, 0)
    # Neighbours that are seen from the other side belong to the other face of a wall.
    near &= np.einsum("nki,ni->nk", view[index], view) > 0.0
    count = near.sum(axis=1)
    weight = near[:, :, None] / np.maximum(count, 1)[:, None, None]
    offset = points[index] - (points[index] * weight).sum(axis=1)[:, None, :]
    spread, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", offset * weight, offset))
    normals = axes[:, :, 0]
    away = np.einsum("ni,ni->n", normals, view) < 0.0
    normals = np.where(away[:, None], -normals, normals)
    return normals, (count >= 4) & (spread[:, 0] < 0.2 * spread[:, 1])
