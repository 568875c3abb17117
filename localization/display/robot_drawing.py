"""Shapes of the robot in the display: boxes and cylinders of a Pioneer 3-AT's size, and its ghost."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr

from localization.display.colours import ORANGE, WHITE, Colour

# Pioneer 3-AT data sheet (MobileRobots): 508 mm long, 497 mm wide, 277 mm high, wheels 222 mm across.
LENGTH: Final = 0.508
WIDTH: Final = 0.497
HEIGHT: Final = 0.277
WHEEL_RADIUS: Final = 0.111
# Comments of MobileRobots' ``pioneer3at.urdf`` (amr-ros-config).
WHEEL_WIDTH: Final = 0.075
WHEELBASE: Final = 0.269
TRACK: Final = 0.394

SWING_RADIUS: Final = 0.34
"""Radius of the circle that the robot needs to turn on the spot [m]; data sheet."""

_RED: Final[Colour] = (222, 62, 38)
_BLACK: Final[Colour] = (38, 38, 42)
_DECK: Final[Colour] = (70, 72, 78)
_CLEARANCE: Final = 0.08
"""Ground clearance of the chassis [m]."""


def parts(paint: Colour | None = None) -> dict[str, rr.AsComponents]:
    """Return the parts of the body, in ``base_link``, by name; ``paint`` replaces the red."""
    red = _RED if paint is None else paint
    inner = TRACK - WHEEL_WIDTH - 0.01
    deck = 0.02
    tall = HEIGHT - deck - _CLEARANCE
    corners = [(x, y) for x in (1, -1) for y in (1, -1)]
    return {
        "chassis": rr.Boxes3D(
            half_sizes=[(0.5 * LENGTH, 0.5 * inner, 0.5 * tall)],
            centers=[(0.0, 0.0, _CLEARANCE + 0.5 * tall)],
            colors=[red],
            fill_mode="solid",
        ),
        # The bright bar marks the front, visible from any distance.
        "deck": rr.Boxes3D(
            half_sizes=[(0.40 * LENGTH, 0.5 * WIDTH, 0.5 * deck), (0.05, 0.5 * WIDTH, 0.5 * deck)],
            centers=[
                (-0.10 * LENGTH, 0.0, HEIGHT - 0.5 * deck),
                (0.5 * LENGTH - 0.05, 0.0, HEIGHT - 0.5 * deck),
            ],
            colors=[red, WHITE],
            fill_mode="solid",
        ),
        "wheels": rr.Cylinders3D(
            lengths=[WHEEL_WIDTH] * 4,
            radii=[WHEEL_RADIUS] * 4,
            centers=[(0.5 * WHEELBASE * x, 0.5 * TRACK * y, WHEEL_RADIUS) for x, y in corners],
            rotation_axis_angles=[rr.RotationAxisAngle((1, 0, 0), degrees=90)] * 4,
            colors=[_BLACK],
            fill_mode="solid",
        ),
    }


def swing(colour: Colour) -> rr.AsComponents:
    """Return the circle that the robot needs to turn on the spot, in ``base_link``."""
    turn = np.linspace(0.0, 2.0 * np.pi, 49)
    circle = np.stack([np.cos(turn), np.sin(turn), np.full(49, 0.1)], axis=1)
    circle[:, :2] *= SWING_RADIUS
    return rr.LineStrips3D([circle], colors=[colour], radii=rr.Radius.ui_points(1.5))


def scanner() -> rr.AsComponents:
    """Return a scanner's housing, about the origin of its frame."""
    return rr.Cylinders3D(
        lengths=[0.12], radii=[0.055], centers=[(0, 0, -0.02)], colors=[_DECK], fill_mode="solid"
    )


def ghost(label: str, colour: Colour = ORANGE) -> dict[str, rr.AsComponents]:
    """Return the parts of a hinted robot's outline by name, in its own frame."""
    return {
        "outline": rr.Boxes3D(
            half_sizes=[(0.5 * LENGTH, 0.5 * WIDTH, 0.5 * HEIGHT)],
            centers=[(0.0, 0.0, 0.5 * HEIGHT)],
            colors=[colour],
            radii=rr.Radius.ui_points(1.2),
            fill_mode="majorwireframe",
        ),
        "heading": rr.Arrows3D(
            origins=[(0.0, 0.0, HEIGHT)],
            vectors=[(0.8, 0.0, 0.0)],
            colors=[colour],
            radii=rr.Radius.ui_points(1.5),
        ),
        # The label is behind the ghost, where it hides neither the ghost nor the view ahead.
        "label": rr.Points3D(
            [(-0.9, 0.0, HEIGHT)], colors=[colour], radii=rr.Radius.ui_points(0.5), labels=[label]
        ),
    }
