"""The operator's display: robot messages in, a rerun recording out, with every time the robot's own.

What is drawn comes from the topics that any client can have; truth only if the robot publishes it. The
display never stops its client: what cannot be shown is counted, said once, and left out.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

import numpy as np
import rerun as rr

from localization.display import colours as palette
from localization.display.map_drawing import MapDrawing
from localization.display.rerun_sink import Canvas, Sink
from localization.display.time_plots import Level, TimePlots
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import SECOND, Pose
from teleop.operator import message_decoding as decode
from teleop.operator.display_layout import LANE_COLOURS, LEGEND_TEXT, SERIES, blueprint
from teleop.operator.message_decoding import Message

HINT_SHOWN: Final = 10 * SECOND
"""A hint's ghost stays this long after its verdict [ns]."""
_REMEMBERED: Final = 50
"""Poses kept for the comparison with truth, which may come a little earlier or later."""
_FLUSH: Final = 3.0
"""How long closing may wait for a viewer that does not take what was sent [s]."""

_log = logging.getLogger(__name__)


class Display:
    """A client of the robot's topics that draws them; see ``topics`` for which."""

    def __init__(self, cloud: Cloud, *, sink: Sink, strict: bool = False) -> None:
        """Open the sink and draw the map.

        Args:
            cloud: the prebuilt cloud, this side's copy.
            sink: where to.
            strict: raise what would otherwise be counted, as tests want it.
        """
        self.failures: Counter[str] = Counter()
        """How many messages could not be shown, by topic."""
        # rerun swallows mistakes by default, each in its own way; here one place handles them all.
        rr.set_strict_mode(True)
        self._cloud, self._strict = cloud, strict
        self._canvas = Canvas(sink, blueprint(*cloud.bounds))
        self._scene = MapDrawing(self._canvas, cloud)
        self._instruments = TimePlots(self._canvas, LANE_COLOURS, SERIES, LEGEND_TEXT)
        self._now = 0
        self._frames: dict[str, Pose] = {}
        self._estimates: dict[int, FloatArray] = {}
        self._truths: dict[int, FloatArray] = {}
        self._control: tuple[str, str, bool] | None = None
        self._verdict_stamp, self._hint_until = -1, -1
        self._handlers: dict[str, Callable[[Message, int], None]] = {
            "/clock": self._clock,
            "/map_info": self._map_info,
            "/tf": self._tf,
            "/tf_static": self._tf_static,
            "/local_cloud": self._local_cloud,
            "/amcl_pose": self._amcl_pose,
            "/odom": self._odom,
            "/ground_truth/odom": self._ground_truth,
            "/localization/status": self._status,
            "/localization/hint_verdict": self._hint_verdict,
            "/teleop/state": self._teleop_state,
        }

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics it makes use of."""
        return tuple(self._handlers)

    def show(self, topic: str, message: Mapping[str, Any]) -> None:
        """Draw a message; one of a topic that is not in ``topics`` is left aside.

        Args:
            topic: such as ``/tf``.
            message: as decoded from rosbridge: dictionaries, lists or arrays of numbers, bytes.
        """
        if (handler := self._handlers.get(topic)) is None:
            return
        with self._guarded(topic):
            stamp = decode.stamp_of(message)
            handler(message, self._at(self._now if stamp is None else stamp))

    def command(self, forward: float, turn: float, deadman: bool, stamp: int) -> None:
        """Draw what this operator's stick asks for: forward [m/s], turn [rad/s], at a stamp [ns]."""
        with self._guarded("command"):
            self._at(stamp)
            self._instruments.plot("speed/stick", forward if deadman else 0.0)
            self._instruments.state("deadman", "held" if deadman else "released")

    def hint(self, map_from_base: Pose, covariance: FloatArray, stamp: int) -> None:
        """Draw the hint that this operator gives: a pose, and its (6, 6) covariance in ROS's order."""
        with self._guarded("hint"):
            self._at(stamp)
            self._scene.hint(map_from_base, "hint", np.asarray(covariance).reshape(6, 6))
            x, y, _ = map_from_base.position
            yaw = np.rad2deg(map_from_base.yaw)
            self._instruments.event(f"hint given: x {x:.2f} m, y {y:.2f} m, heading {yaw:.0f}°")

    def link(self, *, connected: bool, text: str, stamp: int) -> None:
        """Note that the connection to the robot came or went, and why, at a stamp [ns]."""
        with self._guarded("link"):
            self._at(stamp)
            if self._instruments.state("link", "connected" if connected else "lost"):
                text = f"link {'up' if connected else 'LOST'}: {text}"
            self._instruments.event(text, Level.INFO if connected else Level.ALARM)

    def flush(self) -> None:
        """Send and write what waits, which otherwise happens within half a second."""
        with self._guarded("flush"):
            self._canvas.flush(_FLUSH)

    def close(self) -> None:
        """Send or write what is left, and end the recording; say how much could not be shown."""
        if self.failures:
            _log.warning("could not show %s", dict(self.failures))
        with self._guarded("close"):
            self._canvas.close(_FLUSH)

    @contextmanager
    def _guarded(self, source: str) -> Iterator[None]:
        try:
            yield
        except Exception as error:
            if self._strict:
                raise
            self.failures[source] += 1
            if self.failures[source] == 1:
                _log.warning("cannot show %s (more like it are counted): %r", source, error)

    def _at(self, stamp: int) -> int:
        self._canvas.set_time(stamp)
        return stamp

    def _clock(self, message: Message, _: int) -> None:
        self._now = self._at(decode.time_of(message["clock"]))
        if 0 <= self._hint_until <= self._now:
            self._hint_until = -1
            self._scene.clear_hint()

    def _map_info(self, message: Message, _: int) -> None:
        theirs, ours = str(message["sha256"]), self._cloud.sha256
        name = f"the robot's map {message['name']!r}"
        if theirs == ours:
            self._instruments.state("map", "verified")
            self._instruments.event(f"{name} is the one shown here ({ours[:12]})")
        elif not ours:
            self._instruments.state("map", "unverified")
            self._instruments.event(
                f"{name} ({theirs[:12]}) cannot be compared: the cloud shown here has no hash",
                Level.WARNING,
            )
        else:
            self._instruments.state("map", "other map")
            self._instruments.event(
                f"{name} ({theirs[:12]}) is NOT the one shown here ({ours[:12]}): load the same file",
                Level.ALARM,
            )

    def _tf_static(self, message: Message, _: int) -> None:
        for link in message["transforms"]:
            pose = decode.transform_of(link["transform"])
            parent, child = link["header"]["frame_id"], link["child_frame_id"]
            self._scene.transform(parent, child, pose, static=True)

    def _tf(self, message: Message, stamp: int) -> None:
        moved = set()
        for link in message["transforms"]:
            pose = decode.transform_of(link["transform"])
            parent, child = link["header"]["frame_id"], link["child_frame_id"]
            stamp = self._at(decode.stamp_of(link) or stamp)
            self._frames[child] = pose
            self._scene.transform(parent, child, pose)
            moved.add(child)
        if moved & {"odom", "base_link"} and {"odom", "base_link"} <= self._frames.keys():
            map_from_base = self._frames["odom"] @ self._frames["base_link"]
            self._scene.estimate.add(map_from_base.position)
            self._compare(self._estimates, self._truths, stamp, map_from_base.position)

    def _ground_truth(self, message: Message, stamp: int) -> None:
        position = decode.pose_of(message["pose"]["pose"]).position
        self._scene.truth.add(position)
        self._compare(self._truths, self._estimates, stamp, position)

    def _compare(
        self,
        mine: dict[int, FloatArray],
        other: dict[int, FloatArray],
        stamp: int,
        position: FloatArray,
    ) -> None:
        """Plot the distance of estimate and truth once both of a stamp are there."""
        if (twin := other.pop(stamp, None)) is not None:
            error = 1e3 * float(np.linalg.norm(position - twin))
            self._instruments.plot("position/error", error)
            return
        mine[stamp] = position
        if len(mine) > _REMEMBERED:
            del mine[next(iter(mine))]

    def _local_cloud(self, message: Message, _: int) -> None:
        self._scene.live(*decode.cloud_of(message))

    def _amcl_pose(self, message: Message, _: int) -> None:
        self._scene.uncertainty(
            decode.pose_of(message["pose"]["pose"]),
            decode.covariance_of(message["pose"]["covariance"]),
        )

    def _odom(self, message: Message, _: int) -> None:
        self._instruments.plot("speed/measured", float(message["twist"]["twist"]["linear"]["x"]))

    def _status(self, message: Message, _: int) -> None:
        health = str(message["health"])
        self._instruments.plot("position/sigma", 1e3 * float(message["position_sigma"]))
        self._instruments.plot("fit/fit", float(message["fit"]))
        self._instruments.plot("nis/nis", float(message["nis"]))
        if self._instruments.state("health", health):
            self._scene.health(palette.HEALTH.get(health, palette.GREY))
            why = "; ".join(str(reason) for reason in message["reasons"])
            level = {"tracking": Level.INFO, "lost": Level.ALARM}.get(health, Level.WARNING)
            self._instruments.event(f"{health}{': ' if why else ''}{why}", level)

    def _hint_verdict(self, message: Message, stamp: int) -> None:
        if stamp == self._verdict_stamp:
            return  # latched: it comes again with every new connection
        self._verdict_stamp = stamp
        verdict, hint = str(message["verdict"]), decode.pose_of(message["hint"])
        candidates = [decode.pose_of(pose) for pose in message["candidates"]]
        scores = [float(score) for score in message["scores"]]
        self._scene.verdict(verdict, hint, candidates, scores)
        self._hint_until = stamp + HINT_SHOWN
        text = f"hint {verdict}: {message['reason']}"
        if candidates:
            moved = float(np.linalg.norm(candidates[0].position - hint.position))
            turned = np.rad2deg((hint.inverse() @ candidates[0]).yaw)
            text += f", best {moved:.2f} m and {abs(turned):.0f}° from the hint"
        good = verdict in ("accepted", "kept")
        self._instruments.event(text, Level.INFO if good else Level.WARNING)

    def _teleop_state(self, message: Message, _: int) -> None:
        self._instruments.plot("speed/command", float(message["linear"]))
        state, who = str(message["state"]), str(message["controller"])
        self._instruments.state("control", state)
        before, self._control = self._control, (state, who, bool(message["estop"]))
        if before is None or before == self._control:
            return
        reason = str(message["reason"])
        if before[2] != self._control[2]:
            stopped = self._control[2]
            text = f"E-STOP: {reason}" if stopped else f"e-stop released: {reason}"
            self._instruments.event(text, Level.ALARM if stopped else Level.INFO)
        elif before[1] != who:
            self._instruments.event(f"{who or 'nobody'} drives now: {reason}")
        else:
            self._instruments.event(f"control {state}: {reason}")
