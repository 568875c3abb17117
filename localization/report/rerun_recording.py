"""Rerun recording of a localised log: map, path, sweeps, uncertainty and hypotheses.

It looks like the operator's display but is drawn from estimates instead of messages. Time counts from the
first estimate, because stamps may count from 1970 and the viewer would show all of that time.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import rerun as rr

from localization.display import colours as palette
from localization.display.colours import SKY, VERMILION
from localization.display.entity_paths import TRUTH_PATH
from localization.display.map_drawing import MapDrawing
from localization.display.rerun_sink import Canvas, Sink
from localization.display.time_plots import Level, TimePlots
from localization.evaluation.trajectory import Trajectory
from localization.maps.cloud import Cloud
from localization.report.recording_layout import log_blueprint
from localization.types import SECOND, Estimate, Health, Mounts, Pose

_MOVED: Final = 0.2
"""A sweep is drawn when the robot has moved this far since the last drawn one [m]."""
_TURNED: Final = np.deg2rad(5.0)
"""A sweep is also drawn when the robot has turned by this angle [rad]."""
_WAITED: Final = SECOND
"""A sweep is also drawn after this time [ns]; fewer sweeps keep the recording of a standing robot small."""
_HINT_SHOWN: Final = 10 * SECOND
"""Time for which a hint's ghost is shown [ns]."""
_AROUND: Final = (np.array([-15.0, -15.0, 0.0]), np.array([15.0, 15.0, 0.0]))
"""Bounds of the view of a recording without a map [m]."""
_FLUSH: Final = 10.0
"""Time that closing may take [s]."""

_LANES: Final = {"health": palette.HEALTH}
_SERIES: Final = {
    "position/sigma": ("horizontal sigma", SKY),
    "heading/sigma": ("heading sigma", SKY),
    "fit/fit": ("inlier ratio", SKY),
    "fit/unexplained": ("unexplained", VERMILION),
    "nis/nis": ("NIS", SKY),
}
_LEGEND: Final = f"""\
**Grey** map, lighter with height. **Live points** sweep, coloured by its distance to the map: **teal** 0, green to
**yellow** {palette.DISTANCE_FULL} m or more, **pink** no mapped surface near.

**Red robot, white bar at its front** estimate (always drawn as a Pioneer 3-AT). **Ellipse and wedge** its 95 %
bounds, in the colour of its health. **Blue path** estimate, **white path** reference, if one was given.

**Orange dots** hypotheses of an ambiguous pose, each with the share of the sweeps that it explains.
"""


class LogRecording:
    """Writer of a recording; ``close`` completes it."""

    def __init__(
        self, path: Path, cloud: Cloud | None, mounts: Mounts, truth: Trajectory | None = None
    ) -> None:
        """Begin a recording, replacing a file of that name, and draw the map.

        Args:
            path: The ``.rrd`` file to write.
            cloud: The map; None without one.
            mounts: ``base_from_scanner`` by the scanner's frame.
            truth: Reference trajectory, if there is one.
        """
        rr.set_strict_mode(True)
        self._canvas = Canvas(
            Sink(file=path), log_blueprint(*(_AROUND if cloud is None else cloud.bounds))
        )
        self._map = MapDrawing(self._canvas, cloud)
        self._plots = TimePlots(self._canvas, _LANES, _SERIES, _LEGEND)
        self._reasons: tuple[str, ...] = ()
        self._begin: int | None = None
        self._drawn: tuple[int, Pose] | None = None
        self._hint_until = -1
        for frame, mount in mounts.items():
            self._map.transform("base_link", frame, mount, static=True)
        if truth is not None and len(truth):
            path_of_truth = rr.LineStrips3D.from_fields(strips=[truth.positions])
            self._canvas.draw(TRUTH_PATH, path_of_truth, static=True)

    def show(self, estimate: Estimate) -> None:
        """Draw what changed in an estimate, at its time since the first one."""
        if self._begin is None:
            self._begin = estimate.stamp
        changed = self._plots.is_new("health", estimate.health.value)
        if estimate.sweep is None and estimate.verdict is None and not changed:
            return
        self._canvas.set_time(estimate.stamp - self._begin)
        self._state(estimate)
        self._hints(estimate)
        places = estimate.hypotheses
        self._map.hypotheses(
            [p.map_from_base.position for p in places], [f"{p.score:.0%}" for p in places]
        )
        if estimate.map_from_base is not None:
            self._robot(estimate, estimate.map_from_base)

    def close(self) -> None:
        """Write buffered data and end the recording."""
        self._canvas.close(_FLUSH)

    def _state(self, estimate: Estimate) -> None:
        self._map.health(palette.HEALTH[estimate.health.value])
        changed = self._plots.state("health", estimate.health.value)
        if changed or estimate.reasons != self._reasons:
            self._reasons = estimate.reasons
            level = Level.WARNING if estimate.health in _DOUBTFUL else Level.INFO
            text = f"{estimate.health}: {'; '.join(estimate.reasons) or 'nominal'}"
            self._plots.event(text, level)

    def _hints(self, estimate: Estimate) -> None:
        if (answer := estimate.verdict) is not None:
            given = answer.hint
            self._map.hint(given.map_from_base, "hint", given.covariance)
            self._map.verdict(
                answer.verdict.value,
                given.map_from_base,
                [c.map_from_base for c in answer.candidates],
                [c.score for c in answer.candidates],
            )
            self._hint_until = estimate.stamp + _HINT_SHOWN
            self._plots.event(f"hint {answer.verdict}: {answer.reason}")
        elif 0 <= self._hint_until <= estimate.stamp:
            self._hint_until = -1
            self._map.clear_hint()

    def _robot(self, estimate: Estimate, pose: Pose) -> None:
        odom = estimate.odom_from_base
        self._map.transform("map", "odom", pose @ odom.inverse())
        self._map.transform("odom", "base_link", odom)
        self._map.estimate.add(pose.position)
        self._map.uncertainty(pose, estimate.covariance)
        plot, covariance = self._plots.plot, estimate.covariance
        plot("position/sigma", 1e3 * float(np.sqrt(covariance[0, 0] + covariance[1, 1])))
        plot("heading/sigma", float(np.rad2deg(np.sqrt(covariance[5, 5]))))
        if estimate.nis is not None:
            plot("nis/nis", estimate.nis)
        if estimate.unexplained is not None:
            plot("fit/unexplained", estimate.unexplained)
        if estimate.match is not None and estimate.sweep is not None:
            plot("fit/fit", estimate.match.inlier_ratio)
            if self._is_due(estimate.stamp, pose):
                self._drawn = estimate.stamp, pose
                points = pose.apply(estimate.sweep.points)
                distances = estimate.match.distances
                self._map.live(points.astype(np.float32), distances.astype(np.float32))

    def _is_due(self, stamp: int, pose: Pose) -> bool:
        if self._drawn is None:
            return True
        then, before = self._drawn
        step = before.inverse() @ pose
        moved = float(np.linalg.norm(step.position))
        return moved > _MOVED or abs(step.yaw) > _TURNED or stamp - then >= _WAITED


_DOUBTFUL: Final = (Health.SUSPECT, Health.LOST, Health.RELOCALISING)
