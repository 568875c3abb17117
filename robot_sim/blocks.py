"""Building blocks of a scene: walls with doors, pillars and furniture, all from boxes and cylinders."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import mujoco

from robot_sim.errors import WorldError
from robot_sim.p3at import HEADROOM, OBSTACLE_BIT

Color = tuple[float, float, float]

_WALL: Final = (0.85, 0.84, 0.80)
_WOOD: Final = (0.62, 0.45, 0.28)
_METAL: Final = (0.55, 0.57, 0.60)
_FABRIC: Final = (0.25, 0.35, 0.50)
_LEAVES: Final = (0.25, 0.50, 0.25)


@dataclass(frozen=True, slots=True)
class Block:
    """One solid: an upright box or an upright cylinder."""

    name: str
    x: float
    """Centre [m]."""
    y: float
    z: float
    half: tuple[float, float, float]
    """Box: half extents [m]. Cylinder: radius, unused, half height [m]."""
    yaw: float = 0.0
    """[rad]."""
    cylinder: bool = False
    color: Color = _WALL

    def moved(self, x: float, y: float, yaw: float) -> Block:
        """Return the block carried along from a piece's own frame to ``x, y`` [m] and ``yaw`` [rad]."""
        c, s = math.cos(yaw), math.sin(yaw)
        return Block(
            self.name,
            x + c * self.x - s * self.y,
            y + s * self.x + c * self.y,
            self.z,
            self.half,
            self.yaw + yaw,
            self.cylinder,
            self.color,
        )

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add the block as a static obstacle, or as a mere sight if it hangs above the robot."""
        # Ceilings, lintels and table tops would cost a quarter of the physics for nothing.
        bits = OBSTACLE_BIT if self.z - self.half[2] < HEADROOM else 0
        shape = mujoco.mjtGeom.mjGEOM_CYLINDER if self.cylinder else mujoco.mjtGeom.mjGEOM_BOX
        radius, other, height = self.half
        spec.worldbody.add_geom(
            name=self.name,
            type=shape,
            pos=(self.x, self.y, self.z),
            quat=(math.cos(0.5 * self.yaw), 0.0, 0.0, math.sin(0.5 * self.yaw)),
            size=(radius, height, 0.0) if self.cylinder else (radius, other, height),
            rgba=(*self.color, 1.0),
            contype=bits,
            conaffinity=bits,
            friction=(0.3, 0.005, 0.0001),
        )


def box(
    name: str, x: float, y: float, low: float, high: float, size: tuple[float, float], color: Color
) -> Block:
    """Return a box at ``x, y`` from height ``low`` to ``high`` with full ``size`` in x and y [m]."""
    half = (0.5 * size[0], 0.5 * size[1], 0.5 * (high - low))
    return Block(name, x, y, 0.5 * (low + high), half, color=color)


def post(
    name: str, x: float, y: float, low: float, high: float, radius: float, color: Color
) -> Block:
    """Return an upright cylinder from height ``low`` to ``high`` [m]."""
    half = (radius, radius, 0.5 * (high - low))
    return Block(name, x, y, 0.5 * (low + high), half, cylinder=True, color=color)


@dataclass(frozen=True, slots=True)
class Door:
    """An opening in a wall."""

    at: float
    """Distance of its middle from the wall's start [m]."""
    width: float
    """[m]."""
    height: float = 2.05
    """Lower edge of the lintel [m]."""


def wall(
    name: str,
    start: Sequence[float],
    end: Sequence[float],
    *,
    height: float,
    thickness: float,
    doors: Sequence[Door] = (),
) -> Iterator[Block]:
    """Yield the pieces of a wall from ``start`` to ``end`` (2,) [m], with a lintel over each door."""
    length = math.hypot(end[0] - start[0], end[1] - start[1])
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    edges = [0.0]
    for door in sorted(doors, key=lambda d: d.at):
        low, high = door.at - 0.5 * door.width, door.at + 0.5 * door.width
        if low < edges[-1] or high > length:
            raise WorldError(f"wall {name!r}: the door at {door.at} m does not fit into it")
        edges += [low, high]
    edges.append(length)

    def piece(label: str, low: float, high: float, bottom: float) -> Block:
        block = box(label, 0.5 * (low + high), 0.0, bottom, height, (high - low, thickness), _WALL)
        return block.moved(start[0], start[1], yaw)

    for i, (low, high) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        if high - low > 1e-6:
            yield piece(f"{name}_{i}", low, high, 0.0)
    for i, door in enumerate(sorted(doors, key=lambda d: d.at)):
        low, high = door.at - 0.5 * door.width, door.at + 0.5 * door.width
        if door.height < height:
            yield piece(f"{name}_lintel_{i}", low, high, door.height)


def _legs(width: float, depth: float, height: float, thick: float) -> Iterator[Block]:
    for i, (sx, sy) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
        x, y = sx * (0.5 * width - thick), sy * (0.5 * depth - thick)
        yield box(f"leg_{i}", x, y, 0.0, height, (thick, thick), _METAL)


def _desk(width: float, depth: float, height: float) -> Iterator[Block]:
    yield box("top", 0.0, 0.0, height - 0.03, height, (width, depth), _WOOD)
    yield from _legs(width, depth, height - 0.03, 0.06)


def _chair(width: float, depth: float, height: float) -> Iterator[Block]:
    yield post("foot", 0.0, 0.0, 0.03, 0.10, 0.5 * width, _METAL)
    yield post("stem", 0.0, 0.0, 0.10, 0.42, 0.03, _METAL)
    yield box("seat", 0.0, 0.0, 0.42, 0.50, (depth, width), _FABRIC)
    yield box("back", -0.5 * depth + 0.03, 0.0, 0.55, height, (0.06, width), _FABRIC)


def _sofa(width: float, depth: float, height: float) -> Iterator[Block]:
    yield box("seat", 0.0, 0.0, 0.05, 0.42, (width, depth), _FABRIC)
    yield box("back", 0.0, 0.5 * depth - 0.1, 0.42, height, (width, 0.2), _FABRIC)


def _shelf(width: float, depth: float, height: float) -> Iterator[Block]:
    for i, x in enumerate((-0.5 * width + 0.015, 0.5 * width - 0.015)):
        yield box(f"side_{i}", x, 0.0, 0.0, height, (0.03, depth), _WOOD)
    yield box("back", 0.0, 0.5 * depth - 0.01, 0.0, height, (width - 0.06, 0.02), _WOOD)
    for i in range(3):
        z = 0.25 + 0.5 * i * (height - 0.3)
        yield box(f"board_{i}", 0.0, -0.01, z, z + 0.03, (width - 0.06, depth - 0.02), _WOOD)


def _solid(width: float, depth: float, height: float) -> Iterator[Block]:
    yield box("body", 0.0, 0.0, 0.0, height, (width, depth), _METAL)


def _column(width: float, depth: float, height: float) -> Iterator[Block]:
    yield box("body", 0.0, 0.0, 0.0, height, (width, depth), _WALL)


def _round_column(width: float, depth: float, height: float) -> Iterator[Block]:
    yield post("body", 0.0, 0.0, 0.0, height, 0.5 * width, _WALL)


def _plant(width: float, depth: float, height: float) -> Iterator[Block]:
    yield post("pot", 0.0, 0.0, 0.0, 0.42, 0.4 * width, _WOOD)
    yield post("leaves", 0.0, 0.0, 0.55, height, 0.5 * width, _LEAVES)


def _round_table(width: float, depth: float, height: float) -> Iterator[Block]:
    yield post("foot", 0.0, 0.0, 0.0, 0.04, 0.3 * width, _METAL)
    yield post("stem", 0.0, 0.0, 0.04, height - 0.03, 0.05, _METAL)
    yield post("top", 0.0, 0.0, height - 0.03, height, 0.5 * width, _WOOD)


Builder = Callable[[float, float, float], Iterator[Block]]

FURNITURE: Final[Mapping[str, tuple[Builder, tuple[float, float, float]]]] = {
    "desk": (_desk, (1.6, 0.8, 0.74)),
    "table": (_desk, (2.0, 1.0, 0.74)),
    "round_table": (_round_table, (1.0, 1.0, 0.74)),
    "chair": (_chair, (0.5, 0.5, 0.95)),
    "sofa": (_sofa, (1.9, 0.85, 0.8)),
    "shelf": (_shelf, (1.0, 0.35, 1.9)),
    "cabinet": (_solid, (0.8, 0.45, 1.2)),
    "box": (_solid, (0.5, 0.4, 0.45)),
    "counter": (_solid, (2.4, 0.6, 0.92)),
    "pillar": (_column, (0.4, 0.4, 2.8)),
    "round_pillar": (_round_column, (0.4, 0.4, 2.8)),
    "plant": (_plant, (0.5, 0.5, 1.5)),
}
"""Each type's builder and its default size: width (along its x), depth, height [m]."""


def furniture(
    name: str,
    kind: str,
    at: Sequence[float],
    *,
    yaw: float = 0.0,
    size: Sequence[float] | None = None,
) -> Iterator[Block]:
    """Yield the blocks of a piece of furniture at ``at`` (2,) [m], turned by ``yaw`` [rad]."""
    if kind not in FURNITURE:
        raise WorldError(f"no furniture of type {kind!r}; there are: {', '.join(FURNITURE)}")
    build, default = FURNITURE[kind]
    width, depth, height = size if size is not None else default
    for part in build(width, depth, height):
        block = part.moved(at[0], at[1], yaw)
        yield Block(
            f"{name}_{block.name}",
            block.x, block.y, block.z, block.half, block.yaw, block.cylinder, block.color,
        )  # fmt: skip
