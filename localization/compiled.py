"""Inner loops over points, compiled to machine code: they are what a sweep's time goes to.

All are in this one file: what numba keeps on disk is renewed when the file changes that a loop is in, whatever changed in
files of what it calls. They count nothing in parallel and reorder no sums, so that a result repeats to the bit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.int32]
CodeArray = npt.NDArray[np.unsignedinteger[Any]]
BoolArray = npt.NDArray[np.bool_]

_Loop = TypeVar("_Loop", bound=Callable[..., Any])


def compiled(loop: _Loop) -> _Loop:
    """Compile a loop when it is called first, and keep that beside this file or in the user's cache folder.

    Where neither can be written, each process compiles anew, which takes some seconds.
    """
    try:
        return cast(_Loop, numba.njit(cache=True, error_model="numpy")(loop))
    except RuntimeError:
        return cast(_Loop, numba.njit(error_model="numpy")(loop))


BITS = 3
"""Cells along the edge of a block of a grid, as a power of two."""


class GridArrays(NamedTuple):
    """The arrays of a ``NearestGrid``, which explains them."""

    origin: FloatArray
    """(3,) [m]."""
    cell: float
    """Edge of a cell [m]."""
    directory: IndexArray
    """Number of the block at each place (bx, by, bz)."""
    blocks: CodeArray
    """(B, 8, 8, 8)."""
    first: IndexArray
    """(B,)."""
    owners: IndexArray
    """(M,)."""


class CloudArrays(NamedTuple):
    """What the loops need of a prepared map."""

    grid: GridArrays
    """Nearest points."""
    points: FloatArray
    """(N, 3) [m]."""
    normals: npt.NDArray[np.float32]
    """(N, 3)."""
    behind: IndexArray
    """(N,) nearest points of thin walls' other faces, or -1; empty if there are no thin walls."""


@compiled
def _nearest(x: float, y: float, z: float, grid: GridArrays) -> int:
    """Return the index of the point nearest to the centre of the cell around a place [m]; -1 if none is in reach."""
    i = np.floor((x - grid.origin[0]) / grid.cell)
    j = np.floor((y - grid.origin[1]) / grid.cell)
    k = np.floor((z - grid.origin[2]) / grid.cell)
    nx, ny, nz = grid.directory.shape
    # Before they become integers, so that it holds for what is not finite.
    if not (0 <= i < nx << BITS and 0 <= j < ny << BITS and 0 <= k < nz << BITS):
        return -1
    a, b, c = int(i), int(j), int(k)
    block = grid.directory[a >> BITS, b >> BITS, c >> BITS]
    last = (1 << BITS) - 1
    code = int(grid.blocks[block, a & last, b & last, c & last])
    return int(grid.owners[grid.first[block] + code])


@compiled
def _nearest_of_four(x: float, y: float, z: float, cloud: CloudArrays) -> int:
    """Return the nearest of the points nearest to the four cell centres around a place [m], at its height.

    Where the points of a map lie as far apart as cells, as those of an occupancy grid do, the one nearest to the centre of
    the place's own cell is another for one place in ten, and always to the same side. The rows of such a map are alike in
    height.
    """
    best, least, half = -1, np.inf, 0.5 * cloud.grid.cell
    for a in (-half, half):
        for b in (-half, half):
            k = _nearest(x + a, y + b, z, cloud.grid)
            if k < 0:
                continue
            p = cloud.points[k]
            square = (p[0] - x) ** 2 + (p[1] - y) ** 2 + (p[2] - z) ** 2
            if square < least:
                best, least = k, square
    return best


@compiled
def nearest_points(points: FloatArray, grid: GridArrays) -> IndexArray:
    """Return for each point (N, 3) [m] the index of the nearest cloud point; -1 if none is in reach."""
    found = np.empty(len(points), dtype=np.int32)
    for n in range(len(points)):
        found[n] = _nearest(points[n, 0], points[n, 1], points[n, 2], grid)
    return found


UPRIGHT = 0.8
"""Horizontal part of the normal of an upright surface, at least: within 37 degrees of the vertical."""


@compiled
def _put_derivative(
    row: FloatArray, arm: FloatArray, x: float, y: float, z: float, rotation: FloatArray
) -> None:
    """Put in the derivative (6,) of a point's component along a direction in the map.

    d(n . R Exp(t) p)/dt = (p x R'n)' = (R' (Rp x n))'; ``arm`` (3,) is Rp.
    """
    row[0], row[1], row[2] = x, y, z
    turned = (arm[1] * z - arm[2] * y, arm[2] * x - arm[0] * z, arm[0] * y - arm[1] * x)
    for axis in range(3):
        total = 0.0
        for other in range(3):
            total += rotation[other, axis] * turned[other]
        row[3 + axis] = total


@compiled
def plane_distances(
    arms: FloatArray,
    scanners: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    cloud: CloudArrays,
    culling: bool,
    rough: bool,
) -> tuple[FloatArray, FloatArray, IndexArray, FloatArray, FloatArray, FloatArray]:
    """Compare points with the planes of the cloud points nearest to them; see ``Residuals``.

    Args:
        arms: (N, 3) points from the base, along the axes of the map [m].
        scanners: (N, 3) where each was seen from, in the same way.
        position: (3,) of the base [m].
        rotation: (3, 3) of the base.
        cloud: the map.
        culling: whether points are not compared with surfaces seen from behind.
        rough: whether distances along walls are wanted, and the nearest points exactly.

    Returns:
        ``distance``, ``jacobian``, ``nearest``, ``across``, ``along`` and ``along_jacobian``; the last two are empty unless
        the map is rough.
    """
    count = len(arms)
    distance, across = np.empty(count), np.empty(count)
    jacobian, index = np.empty((count, 6)), np.empty(count, dtype=np.int32)
    along = np.zeros(count if rough else 0)
    aside = np.zeros((count if rough else 0, 6))
    for i in range(count):
        arm = arms[i]
        px, py, pz = arm[0] + position[0], arm[1] + position[1], arm[2] + position[2]
        k = _nearest_of_four(px, py, pz, cloud) if rough else _nearest(px, py, pz, cloud.grid)
        index[i] = k
        if k < 0:
            distance[i], across[i], jacobian[i] = np.nan, 0.0, 0.0
            continue
        for face in range(2):
            n = cloud.normals[k]
            nx, ny, nz = float(n[0]), float(n[1]), float(n[2])
            ox, oy, oz = px - cloud.points[k, 0], py - cloud.points[k, 1], pz - cloud.points[k, 2]
            off = nx * ox + ny * oy + nz * oz
            # The scanner's own distance from the plane: negative behind it.
            back = off
            back += nx * (scanners[i, 0] - arm[0]) + ny * (scanners[i, 1] - arm[1])
            back += nz * (scanners[i, 2] - arm[2])
            hidden = culling and back <= 0.0
            if not hidden or face or not len(cloud.behind) or cloud.behind[k] < 0:
                break
            # Of a thin wall the face is meant that the scanner sees.
            k = cloud.behind[k]
            index[i] = k
        distance[i] = np.nan if hidden else off
        across[i] = off - back
        _put_derivative(jacobian[i], arm, nx, ny, nz, rotation)
        level = np.hypot(nx, ny)
        if rough and level > UPRIGHT:
            tx, ty = -ny / level, nx / level
            along[i] = tx * ox + ty * oy
            _put_derivative(aside[i], arm, tx, ty, 0.0, rotation)
    return distance, jacobian, index, across, along, aside


@compiled
def robust_weights(
    distance: FloatArray, along: FloatArray, tangential: float, kernel: float, gate: float
) -> FloatArray:
    """Return Geman-McClure weights (N,), ``(k^2 / (k^2 + r^2))^2``; 0 beyond the gate and for NaN.

    Args:
        distance: (N,) from the planes [m].
        along: (N,) along the walls [m]; empty if that does not count.
        tangential: its weight.
        kernel: scale [m].
        gate: largest distance [m].
    """
    weight = np.zeros(len(distance))
    for i in range(len(distance)):
        if not abs(distance[i]) < gate:
            continue
        square = distance[i] ** 2
        if len(along):
            square += tangential * along[i] ** 2
        weight[i] = (kernel**2 / (kernel**2 + square)) ** 2
    return weight


@compiled
def first_surfaces(
    start: FloatArray,
    line: FloatArray,
    far: FloatArray,
    cloud: CloudArrays,
    nearest: float,
    step: float,
    aside: float,
    grazing: float,
) -> tuple[FloatArray, BoolArray]:
    """Return the first mapped surface on each beam.

    Args:
        start: (B, 3) in the map [m].
        line: (B, 3) unit directions.
        far: (B,) largest distance [m].
        cloud: the map.
        nearest: surfaces nearer than this are ignored [m].
        step: places so far apart are looked at; a surface counts within two of them [m].
        aside: a beam meets a surface if it cuts the plane of a point no farther from it [m].
        grazing: sine of the least incidence.

    Returns:
        Distances (B,) [m], infinite where no surface is met; and whether (B,) the surface faces the beam, as a thin wall does
        from both sides.
    """
    met, facing = np.full(len(start), np.inf), np.zeros(len(start), dtype=np.bool_)
    for b in range(len(start)):
        dx, dy, dz = line[b]
        at = nearest
        while at < far[b] and at < met[b] + 2.0 * step:
            x, y, z = start[b, 0] + at * dx, start[b, 1] + at * dy, start[b, 2] + at * dz
            k, here = _nearest(x, y, z, cloud.grid), at
            at += step
            if k < 0:
                continue
            n = cloud.normals[k]
            nx, ny, nz = float(n[0]), float(n[1]), float(n[2])
            ox, oy, oz = cloud.points[k, 0] - x, cloud.points[k, 1] - y, cloud.points[k, 2] - z
            slope = nx * dx + ny * dy + nz * dz
            if abs(slope) <= grazing:
                continue
            # A beam may run along a surface for metres; it meets it where its line cuts the surface's plane.
            on = (nx * ox + ny * oy + nz * oz) / slope
            beside = (ox - on * dx) ** 2 + (oy - on * dy) ** 2 + (oz - on * dz) ** 2
            if beside < aside**2 and abs(on) < 2.0 * step and here + on < met[b]:
                met[b] = here + on
                thin = len(cloud.behind) > 0 and cloud.behind[k] >= 0
                facing[b] = slope < 0.0 or thin
    return met, facing


@compiled
def share_near(points: FloatArray, others: FloatArray, near: float) -> float:
    """Return the share of points (N, 2) that have another of (M, 2) as near as this [m]."""
    count, begin = 0, 0
    for i in range(len(points)):
        # Beams come in order: what was near to the last is looked at first.
        for j in range(len(others)):
            k = begin + j
            if k >= len(others):
                k -= len(others)
            if (points[i, 0] - others[k, 0]) ** 2 + (points[i, 1] - others[k, 1]) ** 2 < near**2:
                count += 1
                begin = k
                break
    return count / len(points)
