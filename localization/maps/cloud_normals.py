"""Normals for clouds that have none: planes of neighbours, turned to where they can be seen from."""

from __future__ import annotations

import contextlib
import hashlib
import zipfile
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial import cKDTree

from localization.evaluation.trajectory import TrajectoryError
from localization.evaluation.tum_file import read_tum
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud, CloudError
from localization.maps.ground_height import CELL, drivable_surfaces
from localization.maps.normal_orientation import EYE, face_viewers, standing_places
from localization.maps.plane_fitting import planes, thinned

_VERSION = 1
"""Part of the cloud's identity; it changes when the same file would give other points or normals."""
_FEWEST = 1000
"""Least number of points on planes for a map."""
_THICKNESS = 0.05
"""Distance from their common plane within which the points of a cloud are one surface [m]: the noise of a scanner
that maps a floor alone, and less than any wall's height."""
_FLAT_SHARE = 0.995
"""Share of the points that is within this distance, if the cloud is one surface."""
_STEEP = 0.5
"""Upward part of a plane's unit normal below which the plane is a wall, which can be a map by itself."""
_STEP = 0.3
"""Distance between two viewpoints along a drive [m]."""
_TURNED = 2.5
"""Ratio from which another axis than z is taken to be up: its floor is this many times larger than along z,
and the cloud this many times flatter along it."""


def with_normals(
    path: Path,
    points: FloatArray,
    sha256: str,
    *,
    inside: npt.ArrayLike | None = None,
    cache: Path | None = None,
) -> Cloud:
    """Return the cloud of a file that holds points (N, 3) without normals.

    Args:
        path: File of the points; a TUM file of the same name beside it holds the mapping drive.
        points: Points (N, 3) [m].
        sha256: Hex digest of the file's bytes.
        inside: A place in the open (3,) [m]; see ``load_cloud``.
        cache: Folder for the result; None keeps no file.

    Raises:
        CloudError: If the cloud is one plane, has too few planes, or no place from which they could be seen.
    """
    require_relief(path, points)
    drive = _drive(path)
    given = np.zeros(0) if inside is None else np.asarray(inside, dtype=float)
    seen_from = b"".join(a.tobytes() for a in (given, np.zeros(0) if drive is None else drive))
    identity = hashlib.sha256(f"{sha256} {_VERSION}".encode() + seen_from).hexdigest()
    file = None if cache is None else cache / f"{identity[:24]}-cloud.npz"
    if file is not None and (kept := _load(file)) is not None:
        return Cloud(*kept, name=path.stem, sha256=identity)
    flat, normals = planes(thinned(points))
    if len(flat) < _FEWEST:
        raise CloudError(
            f"cloud {path} has {len(flat)} points on planes; a map needs {_FEWEST} at least, one every 0.2 m"
            " (is it in millimetres?)"
        )
    eyes = drive if drive is not None else _places(path, flat, normals, inside)
    normals, known = face_viewers(flat, normals, eyes)
    if np.count_nonzero(known) < _FEWEST:
        raise CloudError(
            f"cloud {path}: only {np.count_nonzero(known)} of its {len(flat)} points can be seen from"
            f" {'the drive beside it' if drive is not None else 'the place inside' if inside is not None else 'its floor'};"
            " give a place in the open, at the height of the mapped walls, as --inside X Y Z"
        )
    flat, normals = flat[known], normals[known]
    if file is not None:
        # The cache is optional: failing to write it is no error.
        with contextlib.suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            np.savez(file, points=flat, normals=normals)
    return Cloud(flat, normals, name=path.stem, sha256=identity)


def require_relief(path: Path, points: FloatArray, normals: FloatArray | None = None) -> None:
    """Reject a cloud that is one plane, not upright: its only normal is that of the plane, and it holds no wall.

    Args:
        path: File of the cloud.
        points: Points (N, 3) [m].
        normals: Normals (N, 3) if the file has any; walls drawn on one plane are a map if theirs lie in it.

    Raises:
        CloudError: If it is one plane.
    """
    centred = points - points.mean(axis=0)
    across = np.linalg.eigh(centred.T @ centred)[1][:, 0]
    distance = np.abs(centred @ across)
    if np.mean(distance < _THICKNESS) < _FLAT_SHARE:
        return
    if normals is not None and np.median(np.abs(normals @ across)) < 0.5:
        return
    if abs(across[2]) < _STEEP:
        return
    where = f" at z = {points[:, 2].mean():.2f} m" if abs(across[2]) > 0.999 else ""
    raise CloudError(
        f"cloud {path}: this cloud is one plane{where}: give map.yaml (a ROS occupancy grid), or heights: a"
        " cloud whose walls have points above each other"
    )


def _drive(path: Path) -> FloatArray | None:
    """Return viewpoints (E, 3) [m] along the drive in the file beside a map; None without such a file."""
    beside = path.with_suffix(".tum")
    if not beside.is_file():
        return None
    try:
        way = read_tum(beside).positions
    except TrajectoryError as error:
        raise CloudError(f"cloud {path}: the drive beside it cannot be read: {error}") from error
    steps = np.concatenate([[0.0], np.linalg.norm(np.diff(way, axis=0), axis=1)])
    _, first = np.unique(np.floor(np.cumsum(steps) / _STEP), return_index=True)
    eyes: FloatArray = way[first] + (0.0, 0.0, EYE)
    return eyes


def _places(
    path: Path, points: FloatArray, normals: FloatArray, inside: npt.ArrayLike | None
) -> FloatArray:
    if inside is not None:
        eyes = _around(points, np.asarray(inside, dtype=float))
        if not len(eyes):
            raise CloudError(
                f"cloud {path}: the place inside must have 0.3 m of room, at sensor height"
            )
        return eyes
    _check_up(path, points, normals)
    eyes = standing_places(points, normals)
    if not len(eyes):
        raise CloudError(
            f"cloud {path} has neither normals nor a floor from which its surfaces could be seen; give a place"
            " in the open as --inside X Y Z"
        )
    return eyes


def _around(points: FloatArray, inside: FloatArray) -> FloatArray:
    """Return viewpoints (E, 3) [m] at the height of a place, in the free space connected with it."""
    ends = np.vstack([points[:, :2], inside[:2]])
    low = np.floor(ends.min(axis=0) / CELL) * CELL - CELL
    size = np.floor((ends.max(axis=0) - low) / CELL).astype(int) + 2
    blocked = np.zeros(tuple(size), dtype=bool)
    at_height = points[np.abs(points[:, 2] - inside[2]) < 0.35]
    blocked[tuple(np.floor((at_height[:, :2] - low) / CELL).astype(int).T)] = True
    label, _ = ndimage.label(~blocked)
    home = np.floor((inside[:2] - low) / CELL).astype(int)
    if not ((home >= 0) & (home < size)).all() or blocked[tuple(home)]:
        return np.zeros((0, 3))
    cells = np.argwhere(label == label[tuple(home)])
    eyes = np.column_stack([low + (cells + 0.5) * CELL, np.full(len(cells), inside[2])])
    distance, _ = cKDTree(points).query(eyes, distance_upper_bound=0.25)
    free: FloatArray = eyes[~np.isfinite(distance)]
    return free


def _check_up(path: Path, points: FloatArray, normals: FloatArray) -> None:
    """Raise CloudError if the cloud's floor is level along another axis than z."""
    size = np.ptp(points, axis=0)
    areas = []
    for axis in range(3):
        order = [a for a in range(3) if a != axis] + [axis]
        level = points[np.abs(normals[:, axis]) > 0.8][:, order]
        if len(level):
            _, height = drivable_surfaces(
                level, points.min(axis=0)[order], points.max(axis=0)[order]
            )
            areas.append(float(np.isfinite(height).sum()))
        else:
            areas.append(0.0)
    best = int(np.argmax(areas))
    if best != 2 and areas[best] > _TURNED * areas[2] and size[2] > _TURNED * size[best]:
        name = "xyz"[best]
        turn = "(x, -z, y)" if best == 1 else "(y, z, x)"
        raise CloudError(
            f"cloud {path} seems to have {name} as its up axis: turn it so that z is up, to {turn};"
            " if z is up nevertheless, give a place in the open as --inside X Y Z"
        )


def _load(file: Path) -> tuple[FloatArray, FloatArray] | None:
    try:
        with file.open("rb") as raw, np.load(raw, allow_pickle=False) as data:
            return data["points"], data["normals"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
