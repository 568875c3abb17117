"""Rerun recording of several robots that might have been the same one: paths, bodies and figures on one time line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from localization.display import robot_drawing as body
from localization.display.colours import ORANGE, SKY, VERMILION, WHITE, Colour
from localization.display.entity_paths import LOG, MAP, PLOTS, TIMELINE
from localization.display.map_drawing import MapDrawing
from localization.display.path_drawing import JUMP
from localization.display.rerun_sink import Canvas, Sink
from localization.display.rerun_views import events_view, plot_view, world_view
from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import IntArray

COLOURS: Final[tuple[Colour, ...]] = (SKY, ORANGE, VERMILION, WHITE)
"""Colours of the robots, in their order."""
_STRIDE: Final = 5
"""Every so many ticks the robots are drawn: ten times a second."""
_AROUND: Final = np.array([4.0, 4.0, 0.0])
"""What the view shows around the paths [m]."""
_FLUSH: Final = 10.0
"""Time that closing may take [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Future:
    """What became of one of the robots."""

    name: str
    """Its name."""
    trajectory: Trajectory
    """Its true poses ``map_from_base``."""
    stamps: IntArray
    """(N,) times of the figures [ns]."""
    figures: Mapping[str, FloatArray]
    """(N,) figures by name, with their units in it."""
    events: Sequence[tuple[int, str]] = field(default=())
    """What happened: stamp [ns] and text."""


def write_futures(path: Path, cloud: Cloud, futures: Sequence[Future]) -> None:
    """Write a recording, replacing a file of that name.

    Args:
        path: The ``.rrd`` file.
        cloud: The map.
        futures: The robots; at most as many as there are colours.
    """
    rr.set_strict_mode(True)
    names = list(futures[0].figures)
    canvas = Canvas(Sink(file=path), _blueprint(futures, names))
    MapDrawing(canvas, cloud)
    for i, (future, colour) in enumerate(zip(futures, COLOURS, strict=False)):
        _robot(canvas, i, future, colour)
        _figures(canvas, f"robot_{i}", future, names, colour)
    for stamp, text in sorted((s, f"{f.name}: {t}") for f in futures for s, t in f.events):
        canvas.set_time(stamp)
        canvas.draw(LOG, rr.TextLog(text))
    canvas.close(_FLUSH)


def _robot(canvas: Canvas, number: int, future: Future, colour: Colour) -> None:
    entity = f"{MAP}/robot_{number}"
    for name, part in body.parts(colour).items():
        canvas.draw(f"{entity}/body/{name}", part, static=True)
    # Above each other, for up to the fork the robots are at the same place.
    above = (0.0, 0.0, 0.6 + 0.4 * number)
    label = rr.Points3D([above], labels=[future.name], colors=[colour], radii=0.01)
    canvas.draw(f"{entity}/name", label, static=True)
    way = future.trajectory.positions[::_STRIDE] + (0.0, 0.0, 0.04 + 0.04 * number)
    jumps = np.flatnonzero(np.linalg.norm(np.diff(way, axis=0), axis=1) > JUMP) + 1
    path = rr.LineStrips3D(np.split(way, jumps), colors=[colour], radii=rr.Radius.ui_points(1.6))
    canvas.draw(f"{MAP}/path_of_{number}", path, static=True)
    for i in range(0, len(future.trajectory), _STRIDE):
        canvas.set_time(int(future.trajectory.stamps[i]))
        pose = future.trajectory.pose(i)
        w, x, y, z = pose.quaternion_wxyz
        turn = rr.Quaternion(xyzw=[x, y, z, w])
        canvas.draw(entity, rr.Transform3D(translation=pose.position, quaternion=turn))


def _figures(
    canvas: Canvas, leaf: str, future: Future, names: Sequence[str], colour: Colour
) -> None:
    for number, name in enumerate(names):
        entity = f"{PLOTS}/figure_{number}/{leaf}"
        canvas.draw(
            entity, rr.SeriesLines(names=[future.name], colors=[colour], widths=[1.5]), static=True
        )
        values = future.figures[name]
        for i in range(0, len(future.stamps), _STRIDE):
            canvas.set_time(int(future.stamps[i]))
            canvas.draw(entity, rr.Scalars(float(values[i])))


def _blueprint(futures: Sequence[Future], names: Sequence[str]) -> rrb.Blueprint:
    positions = np.concatenate([future.trajectory.positions for future in futures])
    around = positions.min(axis=0) - _AROUND, positions.max(axis=0) + _AROUND
    plots = [plot_view(name, f"figure_{i}", window=None) for i, name in enumerate(names)]
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(world_view(*around), events_view(), column_shares=[3, 1]),
            rrb.Horizontal(*plots),
            row_shares=[3, 1],
        ),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed"),
        collapse_panels=True,
    )
