"""Occupancy grids of places made of faces, as gmapping would draw them: by counting where noisy beams end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from localization.geometry import FloatArray
from localization.maps.map_files import load_map
from localization.maps.prepared_map import PreparedMap, prepare
from localization.types import IntArray, Pose
from tests.support_rooms import MOUNTS, Place

CELL = 0.05
"""Side of a grid's cell [m]."""
_BEAMS = np.deg2rad(np.arange(-180.0, 180.0, 1.0))
_TURN = np.deg2rad(0.5)
"""Error of the heading of the poses that a grid was drawn from, one sigma [rad]."""
_HIT_SHARE = 0.25
"""A cell is occupied if at least this share of the beams that reach it end there: gmapping's rule."""


def write_grid(
    place: Place,
    poses: Sequence[Pose],
    folder: Path,
    *,
    reach: float = 12.0,
    noise: float = 0.5 * CELL,
    slant: float = 0.37,
    seed: int = 0,
) -> Path:
    """Write ``map.yaml`` and ``map.pgm`` of what a scanner sees of a place from some poses.

    Args:
        place: of upright faces.
        poses: of the base, each with a whole turn of beams.
        folder: where the files are put.
        reach: longest beam [m]; farther away nothing is seen, and the beam's way counts as free.
        noise: of a beam's end, and of each pose, one sigma [m].
        slant: angle between the grid's rows and the map's x axis [rad].
        seed: of the noise.
    """
    rng = np.random.default_rng(seed)
    upright = Pose.planar(0.0, 0.0, -slant)
    corners = upright.apply(np.array([p.position for p in poses]))[:, :2]
    low = np.floor(corners.min(axis=0) - reach - 1.0)
    columns, rows = np.ceil((corners.max(axis=0) + reach + 1.0 - low) / CELL).astype(int)
    ends, passed = np.zeros((rows, columns)), np.zeros((rows, columns))
    mount = MOUNTS["laser_horizontal"]
    shares = np.arange(0.0, reach, 0.5 * CELL)
    for pose in poses:
        start = pose.apply(mount.position[None])[0]
        angles = _BEAMS + pose.yaw + rng.uniform(0.0, 0.01)
        ways = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
        far = place.cast(np.tile(start, (len(ways), 1)), ways)
        met = far < reach
        far = np.where(met, far + noise * rng.standard_normal(len(far)), reach)
        x, y, turn = (rng.standard_normal(3) * [noise, noise, _TURN]).tolist()
        drawn = upright @ Pose.planar(x, y, turn)
        at = drawn.apply((start + shares[:, None, None] * ways).reshape(-1, 3))[:, :2]
        before = (shares[:, None] < far - CELL).ravel()
        np.add.at(passed, _cells(at[before], low), 0.5)
        hit = drawn.apply(start + far[met, None] * ways[met])[:, :2]
        np.add.at(ends, _cells(hit, low), 1.0)
    seen = passed + ends
    occupied = (ends > 0.0) & (ends >= _HIT_SHARE * seen)
    shades = np.where(occupied, 0, np.where(seen > 0.0, 254, 205)).astype(np.uint8)
    Image.fromarray(shades[::-1]).save(folder / "map.pgm")
    origin = upright.inverse().apply(np.array([[*low, 0.0]]))[0]
    file = folder / "map.yaml"
    file.write_text(
        f"image: map.pgm\nresolution: {CELL}\norigin: [{origin[0]}, {origin[1]}, {slant}]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return file


def grid_of(
    place: Place, poses: Sequence[Pose], folder: Path, *, reach: float = 12.0
) -> PreparedMap:
    """Return the map of a grid that was written and read again; arguments as of ``write_grid``."""
    return prepare(load_map(write_grid(place, poses, folder, reach=reach)))


def _cells(at: FloatArray, low: FloatArray) -> tuple[IntArray, IntArray]:
    """Rows and columns of points (N, 2) [m]."""
    column, row = np.floor((at - low) / CELL).astype(int).T
    return row, column
