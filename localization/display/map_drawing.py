"""Drawing in the frame ``map``: cloud, live sweep, robot, paths, uncertainty and hints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt
import rerun as rr

from localization.display import entity_paths as at, robot_drawing as body
from localization.display.colours import (
    GREY,
    ORANGE,
    SKY,
    VERDICT,
    WHITE,
    Colour,
    Colours,
    distance_colours,
    height_greys,
)
from localization.display.path_drawing import PathDrawing
from localization.display.rerun_sink import Canvas
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import Pose

Floats: TypeAlias = npt.NDArray[np.float32]

HEADROOM: Final = 1.9
"""Height over the map's floor above which points go to the ``overhead`` entities [m]."""
MAP_POINTS: Final = 120_000
"""Approximate number of map points drawn at most; a software renderer is too slow for more."""
ELLIPSE: Final = float(np.sqrt(5.991))
"""Half axes of the 95 % ellipse in sigmas: the chi-square quantile for 2 degrees of freedom is 5.991."""
HEADING: Final = 1.960
"""Half angle of the 95 % heading wedge in sigmas."""

_MAP_RADIUS: Final = 0.022
"""Radius of a map point [m]: near the spacing of the points."""
_LIVE_RADIUS: Final = rr.Radius.ui_points(2.0)
"""Radius of a live point in pixels: visible from afar, and precise from near."""
_LIFT: Final = 0.02
"""Height at which lines on the floor are drawn [m]; lower, the floor's points would cover them."""
_PARKED: Final = (0.0, -2000.0, 0.0)
"""Place of a robot without a pose [m]: behind the view of the whole map, so that only the view around the robot
shows it, and nobody takes it for an estimate. float32 resolves 0.1 mm there."""
_CIRCLE: Final = np.stack(
    [np.cos(np.linspace(0, 2 * np.pi, 49)), np.sin(np.linspace(0, 2 * np.pi, 49))], axis=1
)


class MapDrawing:
    """Draws the map, the robot and the sweeps from poses and arrays, independently of messages."""

    def __init__(self, canvas: Canvas, cloud: Cloud | None) -> None:
        self._canvas = canvas
        self._entities = {"map": at.MAP, "odom": "map/odom", "base_link": at.BASE}
        self._scanners: list[str] = []
        self._hint_shapes: set[str] = set()
        self._undecided = False
        self._placed, self._health = False, GREY
        self._live: Floats | None = None
        self._scans: set[str] = set()
        self._pale, self._mapped = False, False
        # A percentile instead of the minimum: a few stray points lie below any floor.
        self._ceiling = HEADROOM
        self._canvas.draw(at.MAP, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        if cloud is not None:
            self.map(cloud)
        # The estimate is drawn over the truth, which shows as a pale rim where the two agree.
        self.estimate = PathDrawing(canvas, at.ESTIMATE_PATH, SKY, width=1.2, lift=0.06)
        self.truth = PathDrawing(canvas, at.TRUTH_PATH, WHITE, width=2.0, lift=_LIFT)

    def map(self, cloud: Cloud) -> None:
        """Draw the map, in the place of another one."""
        self.clear_map()
        self._ceiling = HEADROOM + float(np.percentile(cloud.points[:, 2], 1.0))
        stride = -(-len(cloud.points) // MAP_POINTS)
        # Every n-th point in a fixed random order gives an even map for any order of the file.
        order = np.random.default_rng(0).permutation(len(cloud.points))[::stride]
        points = cloud.points[order]
        high = points[:, 2] > self._ceiling
        for entity, part in ((at.CLOUD, points[~high]), (at.OVERHEAD, points[high])):
            if len(part):
                colours = height_greys(part[:, 2])
                self._canvas.draw(
                    entity, rr.Points3D(part, colors=colours, radii=_MAP_RADIUS), static=True
                )
        self._mapped = True

    def clear_map(self) -> None:
        """Remove the map."""
        if self._mapped:
            for entity in (at.CLOUD, at.OVERHEAD):
                self._canvas.draw(entity, rr.Points3D([]), static=True)
        self._mapped = False

    def live(self, points: Floats, distances: Floats) -> None:
        """Draw a sweep (N, 3) in ``map`` [m], coloured by its distances (N,) to the map [m]."""
        self._live = points
        self._draw_live(points, distance_colours(distances))

    def fade_live(self) -> None:
        """Draw the last sweep in grey, since it is old."""
        if self._live is not None:
            self._draw_live(self._live, np.full((len(self._live), 3), GREY, dtype=np.uint8))
            self._live = None

    def clear_live(self) -> None:
        """Remove the last sweep."""
        self._live = None
        for entity in (at.LIVE, at.LIVE_OVERHEAD):
            self._canvas.draw(entity, rr.Clear(recursive=False))

    def _draw_live(self, points: Floats, colours: Colours) -> None:
        high = points[:, 2] > self._ceiling
        for entity, part in ((at.LIVE, ~high), (at.LIVE_OVERHEAD, high)):
            self._canvas.draw(
                entity, rr.Points3D(points[part], colors=colours[part], radii=_LIVE_RADIUS)
            )

    def scan(self, scanner: str, points: FloatArray, colour: Colour) -> None:
        """Draw a scan (N, 3) around the robot, in ``base_link`` [m], for want of a sweep in the map."""
        low = points[points[:, 2] < HEADROOM]
        entity = f"{at.SCANS}/{scanner}"
        self._scans.add(entity)
        self._canvas.draw(entity, rr.Points3D(low, colors=[colour], radii=_LIVE_RADIUS))

    def fade_scans(self) -> None:
        """Draw the scans around the robot in grey, since they are old."""
        for entity in sorted(self._scans):
            self._canvas.draw(entity, rr.Points3D.from_fields(colors=[GREY]))

    def clear_scans(self) -> None:
        """Remove the scans around the robot."""
        for entity in sorted(self._scans):
            self._canvas.draw(entity, rr.Clear(recursive=False))
        self._scans.clear()

    def park(self) -> None:
        """Draw the robot outside of the map, since its pose is not known."""
        self._canvas.draw("map/odom", rr.Transform3D(translation=_PARKED))
        self._canvas.draw(at.UNCERTAINTY, rr.Clear(recursive=False))
        self._show_body()

    def fade_body(self, faded: bool) -> None:
        """Draw the robot in grey, since its pose is old, or in its colours."""
        if self._placed and faded != self._pale:
            self._pale = faded
            for name, part in body.parts(GREY if faded else None).items():
                self._canvas.draw(f"{at.BODY}/{name}", part)
            self._canvas.draw(f"{at.BASE}/swing", body.swing(GREY if faded else self._health))

    def transform(self, parent: str, child: str, pose: Pose, *, static: bool = False) -> None:
        """Set the pose of a frame, ``parent_from_child``; frames not connected with ``map`` are ignored."""
        if parent not in self._entities:
            return
        entity = self._entities.setdefault(child, f"{self._entities[parent]}/{child}")
        self._canvas.draw(entity, _transform(pose), static=static)
        if static and child.startswith("laser"):
            self._scanners.append(entity)
        if parent == "map":
            # Before the pose is known, a body would be drawn at the origin and be mistaken for the estimate.
            self._show_body()
        if self._placed:
            self._show_scanners()

    def _show_body(self) -> None:
        if not self._placed:
            self._placed = True
            for name, part in body.parts().items():
                self._canvas.draw(f"{at.BODY}/{name}", part)
            self.health(self._health)
        self._show_scanners()

    def _show_scanners(self) -> None:
        for scanner in self._scanners:
            self._canvas.draw(f"{scanner}/housing", body.scanner())
        self._scanners.clear()

    def health(self, colour: Colour) -> None:
        """Set the colour of the robot's turning circle and of its uncertainty."""
        self._health = colour
        if self._placed:
            self._canvas.draw(f"{at.BASE}/swing", body.swing(colour))

    def uncertainty(self, pose: Pose, covariance: FloatArray) -> None:
        """Draw the 95 % ellipse of the position and the 95 % wedge of the heading.

        Args:
            pose: Pose ``map_from_base``.
            covariance: Covariance (6, 6) in ROS's order [m, rad].
        """
        spread = ELLIPSE * _root(covariance[:2, :2])
        ellipse = np.column_stack([_CIRCLE @ spread.T, np.zeros(len(_CIRCLE))])
        half = min(HEADING * float(np.sqrt(max(covariance[5, 5], 0.0))), np.pi)
        sides = [pose.yaw - half, pose.yaw + half]
        tips = [(np.cos(a), np.sin(a), 0.0) for a in sides]
        wedge = np.array([tips[0], (0.0, 0.0, 0.0), tips[1]])
        foot = pose.position + (0.0, 0.0, _LIFT)
        self._canvas.draw(
            at.UNCERTAINTY,
            rr.LineStrips3D(
                [ellipse + foot, wedge + foot],
                colors=[self._health],
                radii=rr.Radius.ui_points(1.2),
            ),
        )

    def hint(self, pose: Pose, label: str, covariance: FloatArray | None = None) -> None:
        """Draw the ghost of a hint, with the 95 % ellipse of its covariance (6, 6) if that is given."""
        self.clear_hint()
        self._ghost(pose, label, ORANGE)
        if covariance is not None:
            ring = np.column_stack(
                [_CIRCLE @ (ELLIPSE * _root(covariance[:2, :2])).T, np.zeros(len(_CIRCLE))]
            )
            self._hint_shape(
                "window",
                rr.LineStrips3D(
                    [ring + pose.position + (0.0, 0.0, _LIFT)],
                    colors=[ORANGE],
                    radii=rr.Radius.ui_points(1.0),
                ),
            )

    def verdict(
        self, verdict: str, hint: Pose, candidates: Sequence[Pose], scores: Sequence[float]
    ) -> None:
        """Draw the answer to a hint: candidates with scores, and an arrow to an accepted pose."""
        self._ghost(hint, f"hint {verdict}", VERDICT.get(verdict, ORANGE))
        if not candidates:
            return
        self._hint_shape(
            "candidates",
            rr.Points3D(
                [c.position + (0.0, 0.0, body.HEIGHT) for c in candidates],
                colors=[VERDICT.get(verdict, ORANGE)],
                radii=rr.Radius.ui_points(5.0),
                labels=[f"{score:.0%}" for score in scores],
                # A single label would only hide the robot; the event holds the score as well.
                show_labels=len(candidates) > 1,
            ),
        )
        if verdict in ("accepted", "kept"):
            lift = (0.0, 0.0, body.HEIGHT)
            self._hint_shape(
                "move",
                rr.Arrows3D(
                    origins=[hint.position + lift],
                    vectors=[candidates[0].position - hint.position],
                    colors=[VERDICT[verdict]],
                    radii=rr.Radius.ui_points(2.0),
                ),
            )

    def hypotheses(self, positions: Sequence[FloatArray], labels: Sequence[str] = ()) -> None:
        """Draw the places between which a search has not decided yet; without any, remove them.

        Args:
            positions: Positions (3,) [m], best first.
            labels: A text for each, or none.
        """
        if positions:
            dots = rr.Points3D(
                [p + (0.0, 0.0, body.HEIGHT) for p in positions],
                colors=[ORANGE],
                radii=rr.Radius.ui_points(6.0),
                labels=list(labels) or None,
                show_labels=bool(labels),
            )
            self._canvas.draw(at.HYPOTHESES, dots)
        elif self._undecided:
            self._canvas.draw(at.HYPOTHESES, rr.Clear(recursive=False))
        self._undecided = bool(positions)

    def clear_hint(self) -> None:
        """Remove ghost, candidates and arrow."""
        # The ghost's transform stays: if it were cleared and set at the same stamp it would remain cleared,
        # and the ghost would be drawn at the origin.
        for shape in self._hint_shapes:
            self._canvas.draw(shape, rr.Clear(recursive=False))
        self._hint_shapes.clear()

    def _ghost(self, pose: Pose, label: str, colour: Colour) -> None:
        self._canvas.draw(f"{at.HINT}/ghost", _transform(pose))
        for part, shape in body.ghost(label, colour).items():
            self._hint_shape(f"ghost/{part}", shape)

    def _hint_shape(self, name: str, shape: rr.AsComponents) -> None:
        entity = f"{at.HINT}/{name}"
        self._canvas.draw(entity, shape)
        self._hint_shapes.add(entity)


def _transform(pose: Pose) -> rr.Transform3D:
    w, x, y, z = pose.quaternion_wxyz
    return rr.Transform3D(translation=pose.position, quaternion=rr.Quaternion(xyzw=[x, y, z, w]))


def _root(covariance: FloatArray) -> FloatArray:
    """Return a square root of a (2, 2) covariance; rounding below zero counts as zero."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root: FloatArray = vectors * np.sqrt(np.maximum(values, 0.0))
    return root
