"""Occupancy maps of scans whose poses are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from localization.geometry import FloatArray
from localization.maps.map_files import load_map
from localization.maps.prepared_map import PreparedMap, default_cache, prepare
from localization.types import Pose, Scan

_CELL = 0.05
"""Side of a cell of the map [m]."""
_RANGE = 30.0
"""Beams longer than this make no map [m]."""
_OCCUPIED = 0.25
"""A cell is occupied if more than this share of the beams that reach it end in it (GMapping's default)."""


def map_of_scans(name: str, corrected: list[tuple[Scan, Pose]]) -> PreparedMap:
    """Return the map of corrected scans, by way of an occupancy grid on disk as ROS keeps it."""
    folder = default_cache() / "benchmarks" / name
    _write_map(folder, corrected)
    cache = default_cache()
    return prepare(load_map(folder / "map.yaml", cache=cache), cache=cache)


def _write_map(folder: Path, corrected: list[tuple[Scan, Pose]]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    hits, seen, low = _counts(corrected)
    share = hits / np.maximum(seen, 1)
    grey = np.where(seen == 0, 205, np.where(share > _OCCUPIED, 0, 254)).astype(np.uint8)
    Image.fromarray(grey[::-1]).save(folder / "map.pgm")
    (folder / "map.yaml").write_text(
        f"image: map.pgm\nresolution: {_CELL}\norigin: [{low[0]}, {low[1]}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )


def _counts(corrected: list[tuple[Scan, Pose]]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how many beams end in, and reach, each cell (rows, columns), and the lower corner (2,) [m]."""
    rays = []
    for scan, pose in corrected:
        good = np.isfinite(scan.ranges) & (scan.ranges > 0.1) & (scan.ranges < _RANGE)
        angle = scan.angles[good] + pose.yaw
        rays.append(
            (pose.position[:2], np.column_stack([np.cos(angle), np.sin(angle)]), scan.ranges[good])
        )
    ends = np.concatenate([at + line * length[:, None] for at, line, length in rays])
    low = np.floor(ends.min(axis=0)) - 1.0
    columns, rows = (np.ceil((ends.max(axis=0) - low) / _CELL).astype(int) + 20).tolist()
    hits, seen = np.zeros(rows * columns), np.zeros(rows * columns)
    for at, line, length in rays:
        steps = np.arange(0.0, float(length.max(initial=0.0)) + _CELL, 0.5 * _CELL)
        beam, step = np.nonzero(steps < length[:, None])
        places = np.concatenate(
            [at + line[beam] * steps[step][:, None], at + line * length[:, None]]
        )
        cell = ((places - low) / _CELL).astype(np.int64)
        flat = cell[:, 1] * columns + cell[:, 0]
        owner = np.concatenate([beam, np.arange(len(length))])
        once = np.unique(owner * np.int64(rows * columns) + flat) % (rows * columns)
        np.add.at(seen, once, 1.0)
        np.add.at(hits, flat[len(beam) :], 1.0)
    shape = (rows, columns)
    return hits.reshape(shape), seen.reshape(shape), low
