"""Outdoor objects in the furniture catalogue: trees, hedges, benches, lamp posts, fountains."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from robot_sim.scene_objects.blocks import Block, box, ellipsoid, post
from robot_sim.scene_objects.object_builders import ObjectKind, round_solid, solid


def _tree(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    """Yield a trunk and a crown of four lobes; the seed decides their positions."""
    rng = np.random.default_rng(seed)
    clear = 0.35 * height
    trunk = 0.09 * min(width, depth)
    yield post("trunk", 0.0, 0.0, 0.0, 0.7 * height, trunk, "bark")
    yield ellipsoid("crown", 0.0, 0.0, clear, height, (0.72 * width, 0.72 * depth), "leaves")
    for i in range(3):
        bearing = 2.0 * math.pi * (i + float(rng.uniform(-0.25, 0.25))) / 3
        x, y = 0.26 * width * math.cos(bearing), 0.26 * depth * math.sin(bearing)
        low = clear + float(rng.uniform(0.0, 0.15)) * height
        lobe = (0.48 * width, 0.48 * depth)
        yield ellipsoid(f"lobe_{i}", x, y, low, low + 0.4 * height, lobe, "leaves")


def _conifer(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    yield post("trunk", 0.0, 0.0, 0.0, 0.5 * height, 0.06 * width, "bark")
    for i in range(3):
        low, share = height * (0.12 + 0.26 * i), 1.0 - 0.3 * i
        top = min(height, low + 0.42 * height)
        yield ellipsoid(f"tier_{i}", 0.0, 0.0, low, top, (share * width, share * depth), "leaves")


def _bush(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    yield ellipsoid("leaves", 0.0, 0.0, 0.0, height, (width, depth), "leaves")


def _bench(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    """Yield a bench with its back at +y."""
    yield box("seat", 0.0, -0.05, 0.40, 0.45, (width, depth - 0.1), "wood")
    yield box("back", 0.0, 0.5 * depth - 0.03, 0.5, height, (width, 0.04), "wood")
    for i, x in enumerate((-0.4 * width, 0.4 * width)):
        yield box(f"leg_{i}", x, 0.0, 0.0, 0.40, (0.08, 0.8 * depth), "metal")


def _lamp_post(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    yield post("foot", 0.0, 0.0, 0.0, 0.25, 0.5 * width, "metal")
    yield post("pole", 0.0, 0.0, 0.25, height - 0.3, 0.06, "metal")
    yield post("head", 0.0, 0.0, height - 0.3, height, 0.5 * width, "glass")


def _planter(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    """Yield a concrete trough with a plant in it."""
    rim = 0.45 * height
    yield box("trough", 0.0, 0.0, 0.0, rim, (width, depth), "concrete")
    yield ellipsoid("green", 0.0, 0.0, 0.5 * rim, height, (0.9 * width, 0.9 * depth), "leaves")


def _fountain(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    yield post("basin", 0.0, 0.0, 0.0, 0.45, 0.5 * width, "concrete")
    yield post("column", 0.0, 0.0, 0.45, height, 0.08 * width, "concrete")
    yield post("bowl", 0.0, 0.0, 0.75 * height, 0.82 * height, 0.22 * width, "concrete")


def _arch(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    """Yield one bay of an arcade: two piers and the beam they carry."""
    pier = 0.16 * width
    for i, x in enumerate((-0.5 * (width - pier), 0.5 * (width - pier))):
        yield box(f"pier_{i}", x, 0.0, 0.0, 0.75 * height, (pier, depth), "brick")
        shoulder = math.copysign(0.5 * width - 1.4 * pier, x)
        yield box(
            f"shoulder_{i}",
            shoulder,
            0.0,
            0.64 * height,
            0.75 * height,
            (0.8 * pier, depth),
            "brick",
        )
    yield box("beam", 0.0, 0.0, 0.75 * height, height, (width, depth), "brick")


def _bicycle_stand(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    hoops = max(2, round(width / 0.8))
    for i in range(hoops):
        x = -0.5 * width + 0.03 + i * (width - 0.06) / (hoops - 1)
        for j, y in enumerate((-0.5 * depth + 0.03, 0.5 * depth - 0.03)):
            yield post(f"hoop_{i}_{j}", x, y, 0.0, height, 0.025, "metal")
        yield box(f"bar_{i}", x, 0.0, height - 0.05, height, (0.05, depth), "metal")


def _canopy(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    """Yield a flat roof 0.2 m thick, without supports."""
    yield box("roof", 0.0, 0.0, height - 0.2, height, (width, depth), "concrete")


OUTDOOR: Final = {
    "tree": ObjectKind(_tree, (4.0, 4.0, 6.0)),
    "conifer": ObjectKind(_conifer, (2.6, 2.6, 7.0)),
    "bush": ObjectKind(_bush, (1.2, 1.2, 1.0)),
    "hedge": ObjectKind(solid("leaves"), (3.0, 0.6, 1.2)),
    "bench": ObjectKind(_bench, (1.8, 0.6, 0.85)),
    "lamp_post": ObjectKind(_lamp_post, (0.3, 0.3, 4.0)),
    "bollard": ObjectKind(round_solid("concrete"), (0.25, 0.25, 0.8)),
    "planter": ObjectKind(_planter, (1.6, 0.7, 1.1)),
    "fountain": ObjectKind(_fountain, (2.6, 2.6, 1.8)),
    "arch": ObjectKind(_arch, (3.0, 0.5, 3.6)),
    "bicycle_stand": ObjectKind(_bicycle_stand, (3.2, 0.8, 0.8)),
    "canopy": ObjectKind(_canopy, (4.0, 3.0, 3.6)),
    "facade_pier": ObjectKind(solid("brick"), (0.6, 0.25, 5.0)),
    "stone": ObjectKind(round_solid("concrete"), (0.5, 0.5, 0.4)),
}
"""Kinds by their names in a floor plan."""
