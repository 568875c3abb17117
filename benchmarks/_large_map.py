"""A map of two million points: how large it is when prepared, and how long it takes to load."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks._figures import OURS, Figure
from benchmarks._recordings import map_of
from benchmarks._trials import LARGE
from localization.cloud import Cloud, save_cloud
from localization.prepared import prepare

APART = 80.0
"""The buildings stand side by side so far from each other [m]."""
LOADS = 5


def large_map() -> Iterator[Figure]:
    """Two generated buildings side by side, prepared once and then loaded from the cache."""
    clouds = [map_of(scene).cloud for scene in LARGE]
    points = np.concatenate([c.points + [i * APART, 0.0, 0.0] for i, c in enumerate(clouds)])
    normals = np.concatenate([c.normals for c in clouds])
    with tempfile.TemporaryDirectory() as folder:
        cloud = save_cloud(Cloud(points, normals, "large"), Path(folder) / "large.ply")
        begun = time.thread_time()
        world = prepare(cloud, cache=Path(folder))
        built = time.thread_time() - begun
        loads = []
        for _ in range(LOADS):
            begun = time.thread_time()
            world = prepare(cloud, cache=Path(folder))
            loads.append(time.thread_time() - begun)
    size = world.grid.nbytes + cloud.points.nbytes + cloud.normals.nbytes
    case, n = f"map of {len(points) / 1e6:.1f} million points", len(points)
    yield Figure(case, OURS, "cloud and what is derived", size / 1e6, "MB", n, most=200.0)
    yield Figure(case, OURS, "preparing once", built, "s", 1)
    yield Figure(case, OURS, "loading from the cache", max(loads), "s", LOADS, most=1.0)
