"""Inner loops over points and beams against a map: nearest points, distances from planes, first surfaces."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from localization.compiled import compiled

FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.int32]
CodeArray = npt.NDArray[np.unsignedinteger[Any]]
BoolArray = npt.NDArray[np.bool_]

BITS = 3
"""Cells along the edge of a block of a grid, as a power of two."""
BLOCK = 1 << BITS
"""The same as a number."""


class NearestGrid(NamedTuple):
    """Grid that holds the nearest point of a cloud for any place near a surface, in constant time.

    Space is divided into cells, and each cell near a surface stores the point nearest to its centre. Blocks of
    8 x 8 x 8 cells far from any surface are absent, so memory grows with surface, not with volume. A block refers
    to few points and numbers them itself, so a cell takes one byte.
    """

    origin: FloatArray
    """Corner of the first cell (3,) [m]."""
    cell: float
    """Edge of a cell [m]."""
    directory: IndexArray
    """Number of the block at each place (bx, by, bz); 0 where there is no block."""
    blocks: CodeArray
    """Number, within its block, of the point nearest to each cell (B, 8, 8, 8); 0 if none is in reach."""
    first: IndexArray
    """Position in ``owners`` (B,) at which each block's points begin."""
    owners: IndexArray
    """Indices of cloud points (M,); each block's list begins with -1, for no point."""

    @property
    def nbytes(self) -> int:
        """Size of all arrays [bytes]."""
        return self.directory.nbytes + self.blocks.nbytes + self.first.nbytes + self.owners.nbytes

    def nearest(self, points: FloatArray) -> IndexArray:
        """Return for each point (N, 3) [m] the index of the nearest cloud point; -1 if none is in reach.

        The result is exact for the centre of the point's cell.
        """
        found: IndexArray = _nearest_points(points, self)
        return found


class CloudArrays(NamedTuple):
    """What the loops need of a prepared map."""

    grid: NearestGrid
    """Nearest points."""
    points: FloatArray
    """(N, 3) [m]."""
    normals: npt.NDArray[np.float32]
    """(N, 3)."""
    behind: IndexArray
    """(N,) nearest points of thin walls' other faces, or -1; empty if there are no thin walls."""


@compiled
def _nearest(x: float, y: float, z: float, grid: NearestGrid) -> int:
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
def _nearest_points(points: FloatArray, grid: NearestGrid) -> IndexArray:
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
    points: FloatArray,
    origins: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    cloud: CloudArrays,
    culling: bool,
    rough: bool,
) -> tuple[FloatArray, FloatArray, IndexArray, FloatArray, FloatArray, FloatArray]:
    """Compare points with the planes of the cloud points nearest to them; see ``Residuals``.

    Args:
        points: (N, 3) in the base [m].
        origins: (N, 3) where each was seen from [m].
        position: (3,) of the base [m].
        rotation: (3, 3) of the base.
        cloud: the map.
        culling: whether points are not compared with surfaces seen from behind.
        rough: whether distances along walls are wanted, and the nearest points exactly.

    Returns:
        ``distance``, ``jacobian``, ``nearest``, ``across``, ``along`` and ``along_jacobian``; the last two are empty unless
        the map is rough.
    """
    count = len(points)
    distance, across = np.empty(count), np.empty(count)
    jacobian, index = np.empty((count, 6)), np.empty(count, dtype=np.int32)
    along = np.zeros(count if rough else 0)
    aside = np.zeros((count if rough else 0, 6))
    arm, beam = np.empty(3), np.empty(3)
    for i in range(count):
        for a in range(3):
            arm[a], beam[a] = 0.0, 0.0
            for b in range(3):
                arm[a] += rotation[a, b] * points[i, b]
                beam[a] += rotation[a, b] * (points[i, b] - origins[i, b])
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
            facing = nx * beam[0] + ny * beam[1] + nz * beam[2]
            # The scanner's own distance from the plane is negative behind it.
            hidden = culling and off - facing <= 0.0
            if not hidden or face or not len(cloud.behind) or cloud.behind[k] < 0:
                break
            # Of a thin wall the face is meant that the scanner sees.
            k = cloud.behind[k]
            index[i] = k
        distance[i] = np.nan if hidden else off
        across[i] = facing
        _put_derivative(jacobian[i], arm, nx, ny, nz, rotation)
        level = np.hypot(nx, ny)
        if rough and level > UPRIGHT:
            tx, ty = -ny / level, nx / level
            along[i] = tx * ox + ty * oy
            _put_derivative(aside[i], arm, tx, ty, 0.0, rotation)
    return distance, jacobian, index, across, along, aside


class Scales(NamedTuple):
    """What the alignment needs of a ``RegistrationConfig``, which explains it, and of ``LEVER`` and ``GRAZING``."""

    sigma: float
    kernel: float
    gate: float
    tangential: float
    effective_points: float
    normal_noise: float
    grazing: float
    lever: float


@compiled
def point_weights(
    distance: FloatArray,
    jacobian: FloatArray,
    along: FloatArray,
    across: FloatArray,
    nearest: IndexArray,
    lengths: FloatArray,
    spread: npt.NDArray[np.float32],
    kernel: float,
    level_kernel: float,
    limited: bool,
    scales: Scales,
) -> FloatArray:
    """Return Geman-McClure weights (N,) over sigma^2, ``(k^2 / (k^2 + r^2))^2``; in smooth maps by their normals too.

    Where a wall ends, or meets a ceiling, the estimated normals belong to neither. Weights by inverse variance of the
    normals keep a scanner that sees no more than that edge from being held, or pulled, by them alone. So do those by
    incidence: beams that run along a wall meet what is beside it. Under a wide kernel the heading may be off by more
    than such an incidence, which then says nothing.

    Args:
        distance: (N,) as ``plane_distances`` gives it; so are the next four.
        jacobian: (N, 6), of which the third column is the vertical part of the normal.
        along: (N,), or empty in a smooth map.
        across: (N,).
        nearest: (N,).
        lengths: (N,) of the beams [m].
        spread: of the normals around each point of the map [rad]; empty if that does not count.
        kernel: scale for upright surfaces [m].
        level_kernel: the same for floors and ceilings.
        limited: whether the points count as ``effective_points`` at most, for the errors of neighbouring beams are alike.
        scales: settings.
    """
    weight, smooth, total = np.zeros(len(distance)), len(along) == 0, 0.0
    for i in range(len(distance)):
        own = level_kernel if abs(jacobian[i, 2]) > UPRIGHT else kernel
        if not abs(distance[i]) < scales.gate * own:
            continue
        square = distance[i] ** 2
        if not smooth:
            square += scales.tangential * along[i] ** 2
        w = (own**2 / (own**2 + square)) ** 2
        if smooth and own <= scales.kernel:
            w *= min(1.0, abs(across[i]) / (scales.grazing * lengths[i])) ** 2
        if smooth and len(spread):
            noise = max(float(spread[nearest[i]]), scales.normal_noise)
            w *= (scales.normal_noise / noise) ** 2
        weight[i] = w
        total += w
    share = min(1.0, scales.effective_points / total) if limited and total > 0.0 else 1.0
    weight *= share / scales.sigma**2
    return weight


@compiled
def normal_equations(
    jacobian: FloatArray, distance: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return ``J' W J`` (6, 6) and ``J' W d`` (6,); points without weight may have no distance."""
    hessian, gradient = np.zeros((6, 6)), np.zeros(6)
    _add_normal_equations(hessian, gradient, jacobian, distance, weight, 1.0)
    return hessian, gradient


@compiled
def _add_normal_equations(
    hessian: FloatArray,
    gradient: FloatArray,
    jacobian: FloatArray,
    distance: FloatArray,
    weight: FloatArray,
    share: float,
) -> None:
    for i in range(len(distance)):
        if weight[i] == 0.0:
            continue
        for a in range(6):
            part = share * weight[i] * jacobian[i, a]
            gradient[a] += part * distance[i]
            for b in range(a, 6):
                hessian[a, b] += part * jacobian[i, b]
    for a in range(6):
        for b in range(a):
            hessian[a, b] = hessian[b, a]


@compiled
def _solve(matrix: FloatArray, vector: FloatArray) -> None:
    """Put the solution of a positive definite system (6, 6) in the place of its right side (Cholesky).

    What numpy's solver takes to be compiled is three seconds on each new machine.
    """
    for a in range(6):
        for b in range(a + 1):
            for c in range(b):
                matrix[a, b] -= matrix[a, c] * matrix[b, c]
            matrix[a, b] = np.sqrt(matrix[a, a]) if a == b else matrix[a, b] / matrix[b, b]
        for c in range(a):
            vector[a] -= matrix[a, c] * vector[c]
        vector[a] /= matrix[a, a]
    for a in range(5, -1, -1):
        for c in range(a + 1, 6):
            vector[a] -= matrix[c, a] * vector[c]
        vector[a] /= matrix[a, a]


@compiled
def _turn(rotation: FloatArray, x: float, y: float, z: float) -> None:
    """Turn a rotation matrix (3, 3) by a rotation vector [rad] in its own axes (Rodrigues)."""
    square = x * x + y * y + z * z
    angle = np.sqrt(square)
    a, b = (np.sin(angle) / angle, (1.0 - np.cos(angle)) / square) if angle > 1e-8 else (1.0, 0.5)
    for k in range(3):
        u, v, w = rotation[k, 0], rotation[k, 1], rotation[k, 2]
        # Rows turn the other way: r + a r x t + b (r x t) x t.
        p, q, s = v * z - w * y, w * x - u * z, u * y - v * x
        rotation[k, 0] = u + a * p + b * (q * z - s * y)
        rotation[k, 1] = v + a * q + b * (s * x - p * z)
        rotation[k, 2] = w + a * s + b * (p * y - q * x)


@compiled
def _put_departure(
    departure: FloatArray,
    prior_position: FloatArray,
    prior_rotation: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
) -> None:
    """Put in the error (6,) that leads from one pose to another, turned by less than half a turn; see ``difference``."""
    trace = 0.0
    for a in range(3):
        departure[a] = position[a] - prior_position[a]
        for k in range(3):
            trace += prior_rotation[k, a] * rotation[k, a]
        # Of R = R0' R1: half of R[c, b] - R[b, c].
        b, c = (a + 1) % 3, (a + 2) % 3
        departure[3 + a] = 0.0
        for k in range(3):
            departure[3 + a] += 0.5 * prior_rotation[k, c] * rotation[k, b]
            departure[3 + a] -= 0.5 * prior_rotation[k, b] * rotation[k, c]
    sine = np.sqrt(departure[3] ** 2 + departure[4] ** 2 + departure[5] ** 2)
    if sine > 1e-12:
        scale = np.arctan2(sine, 0.5 * (trace - 1.0)) / sine
        for a in range(3, 6):
            departure[a] *= scale


@compiled
def aligned(
    points: FloatArray,
    origins: FloatArray,
    lengths: FloatArray,
    prior_position: FloatArray,
    prior_rotation: FloatArray,
    prior_information: FloatArray,
    cloud: CloudArrays,
    spread: npt.NDArray[np.float32],
    rough: bool,
    kernel: float,
    level_kernel: float,
    iterations: int,
    least: float,
    scales: Scales,
) -> tuple[
    FloatArray, FloatArray, FloatArray, FloatArray, IndexArray, FloatArray, FloatArray, FloatArray
]:
    """Find the pose that minimises ``e' P^-1 e + sum w r^2``, by Gauss-Newton; see ``localization.matching.registration``.

    Args:
        points: (N, 3) in the base [m].
        origins: (N, 3) where each was seen from [m].
        lengths: (N,) of the beams [m].
        prior_position: (3,) of the base [m].
        prior_rotation: (3, 3) of the base.
        prior_information: (6, 6), P^-1.
        cloud: the map.
        spread: as of ``point_weights``.
        rough: whether the map is.
        kernel: scale to begin with for upright surfaces [m]; it is narrowed down to that of ``scales``.
        level_kernel: the same for floors and ceilings.
        iterations: their largest number.
        least: a shorter step ends them [m].
        scales: settings.

    Returns:
        Position (3,) [m] and rotation (3, 3), and the six arrays of ``plane_distances`` there.
    """
    position, rotation = prior_position.copy(), prior_rotation.copy()
    departure, step = np.zeros(6), np.zeros(6)
    while True:
        distance, jacobian, nearest, across, along, aside = plane_distances(
            points, origins, position, rotation, cloud, not rough, rough
        )
        if iterations == 0:
            break
        iterations -= 1
        weight = point_weights(
            distance,
            jacobian,
            along,
            across,
            nearest,
            lengths,
            spread,
            kernel,
            level_kernel,
            not rough,
            scales,
        )
        hessian, gradient = np.zeros((6, 6)), np.zeros(6)
        _add_normal_equations(hessian, gradient, jacobian, distance, weight, 1.0)
        if rough:
            _add_normal_equations(hessian, gradient, aside, along, weight, scales.tangential)
        _put_departure(departure, prior_position, prior_rotation, position, rotation)
        # One Gauss-Newton step of both terms; where a sweep sees one wall only, the prior makes it solvable.
        for a in range(6):
            step[a] = -gradient[a]
            for b in range(6):
                step[a] -= prior_information[a, b] * departure[b]
                hessian[a, b] += prior_information[a, b]
        _solve(hessian, step)
        size = 0.0
        for a in range(3):
            size += step[a] ** 2 + (scales.lever * step[3 + a]) ** 2
        if max(kernel, level_kernel) <= scales.kernel and np.sqrt(size) < least:
            # Half a millimetre on, the points would be seen as they are here.
            break
        for a in range(3):
            position[a] += step[a]
        _turn(rotation, step[3], step[4], step[5])
        # Wide first, so that points far off pull at all; narrow last, so that wrong ones do not.
        kernel = max(scales.kernel, 0.6 * kernel)
        level_kernel = max(scales.kernel, 0.6 * level_kernel)
    return position, rotation, distance, jacobian, nearest, across, along, aside


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
