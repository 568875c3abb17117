"""Glass walls, and gabled glass roofs on a steel frame."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

from robot_sim.errors import WorldError
from robot_sim.number_checks import check_bounds, check_positive
from robot_sim.scene_objects.blocks import Block, box
from robot_sim.scene_objects.plan_elements import Door, Wall, Waypoint
from robot_sim.scene_objects.walls import wall_blocks

GREENHOUSE_PANE: Final = 0.006
"""Thickness of horticultural glass [m]."""
_BAR: Final = 0.06
"""Side of the frame's square bars [m]."""
_STRIP: Final = 0.75
"""Width of the strips that fill a gable [m]."""


@dataclass(frozen=True, slots=True)
class Glazing:
    """A glass wall on a plinth, with posts at regular distances."""

    name: str
    """Name of the glass wall."""
    start: Waypoint
    """x, y of its beginning [m]."""
    end: Waypoint
    """x, y of its end [m]."""
    height: float = 2.8
    """Height of the wall [m]."""
    plinth: float = 0.3
    """Height of the masonry below the glass [m]."""
    spacing: float = 1.5
    """Approximate distance between posts [m]."""
    doors: tuple[Door, ...] = ()
    """Doors in the wall."""

    def __post_init__(self) -> None:
        check_positive(f"glazing {self.name!r}", spacing=self.spacing, plinth=self.plinth)
        if not self.plinth < self.height:
            raise WorldError(
                f"glazing {self.name!r}: the plinth of {self.plinth:g} m must be lower than the"
                f" height of {self.height:g} m"
            )

    def blocks(self) -> Iterator[Block]:
        """Yield plinth, panes, posts and the rail on top."""
        pane = Wall(
            self.name, self.start, self.end, self.height, GREENHOUSE_PANE, "glass", self.doors
        )
        plinth = Wall(
            f"{self.name}_plinth", self.start, self.end, self.plinth, 0.12, "concrete", self.doors
        )
        yield from wall_blocks(pane)
        yield from wall_blocks(plinth)
        for i, at in enumerate(self._posts(pane.length)):
            post = box(f"{self.name}_post_{i}", at, 0.0, 0.0, self.height, (_BAR, _BAR), "metal")
            yield post.moved(*self.start, pane.yaw)
        rail = box(
            f"{self.name}_rail", 0.5 * pane.length, 0.0, self.height - _BAR, self.height,
            (pane.length, _BAR), "metal",
        )  # fmt: skip
        yield rail.moved(*self.start, pane.yaw)

    def _posts(self, length: float) -> Iterator[float]:
        """Yield the distances of all posts from the start: evenly spaced, and at each door's sides."""
        count = max(1, round(length / self.spacing))
        sides = [d.at + s * 0.5 * (d.width + _BAR) for d in self.doors for s in (-1, 1)]
        for i in range(count + 1):
            at = i * length / count
            if all(abs(at - d.at) > 0.5 * d.width + 2 * _BAR for d in self.doors):
                yield at
        yield from sides


@dataclass(frozen=True, slots=True)
class Roof:
    """A gabled roof over a rectangle; its ridge is along the longer side."""

    name: str
    """Name of the roof."""
    bounds: tuple[float, float, float, float]
    """Smallest x, y and largest x, y [m]."""
    eaves: float
    """Height of its lower edges [m]."""
    ridge: float
    """Height of its ridge [m]."""
    material: str = "glass"
    """Material of its slopes and gables."""
    spacing: float = 1.5
    """Approximate distance between rafters [m]."""

    def __post_init__(self) -> None:
        what = f"roof {self.name!r}"
        check_bounds(what, self.bounds)
        check_positive(what, eaves=self.eaves, spacing=self.spacing)
        if not (math.isfinite(self.ridge) and self.ridge > self.eaves):
            raise WorldError(
                f"{what}: the ridge at {self.ridge} m must be higher than the eaves at"
                f" {self.eaves:g} m"
            )

    def blocks(self) -> Iterator[Block]:
        """Yield both slopes with their rafters, the ridge, and the gables."""
        x0, y0, x1, y1 = self.bounds
        middle, along_x = (0.5 * (x0 + x1), 0.5 * (y0 + y1)), x1 - x0 >= y1 - y0
        length, span = max(x1 - x0, y1 - y0), min(x1 - x0, y1 - y0)
        for part in self._parts(length, span):
            block = part.moved(*middle, 0.0 if along_x else 0.5 * math.pi)
            yield replace(block, name=f"{self.name}_{part.name}")

    def _parts(self, length: float, span: float) -> Iterator[Block]:
        """Yield the blocks in a frame with the ridge along x and the origin under its middle."""
        rise = self.ridge - self.eaves
        slope = math.atan2(rise, 0.5 * span)
        half = 0.25 * span / math.cos(slope)
        z = 0.5 * (self.eaves + self.ridge)
        rafters = max(1, round(length / self.spacing))
        for i, side in enumerate((1.0, -1.0)):
            pane = Block(
                f"slope_{i}", 0.0, side * 0.25 * span, z, (half, 0.5 * length, 0.5 * GREENHOUSE_PANE),
                yaw=side * 0.5 * math.pi, pitch=slope, material=self.material,
            )  # fmt: skip
            yield pane
            for j in range(rafters + 1):
                x = (j / rafters - 0.5) * (length - _BAR)
                bar = (half, 0.5 * _BAR, 0.5 * _BAR)
                yield replace(pane, name=f"rafter_{i}_{j}", x=x, half=bar, material="metal")
        yield box("ridge", 0.0, 0.0, self.ridge - 0.1, self.ridge, (length, _BAR), "metal")
        strips = max(2, 2 * round(0.5 * span / _STRIP))
        for i in range(strips):
            y = ((i + 0.5) / strips - 0.5) * span
            top = self.eaves + rise * (1.0 - 2.0 * abs(y) / span)
            for j, x in enumerate((-0.5 * length, 0.5 * length)):
                yield box(
                    f"gable_{j}_{i}",
                    x,
                    y,
                    self.eaves,
                    top,
                    (GREENHOUSE_PANE, span / strips),
                    self.material,
                )
