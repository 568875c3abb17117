"""The operator's display: the robot's messages as a rerun recording, at the robot's times.

It draws topics that any client can subscribe to; ground truth only if the robot publishes it. While the robot is
silent, ``pulse`` greys out what is old and lets time go on for a little, so that the silence is seen. It never
raises into its client: messages that cannot be drawn are counted, and the first of each topic is logged.
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
from localization.display.entity_paths import BANNER
from localization.display.map_drawing import MapDrawing
from localization.display.rerun_sink import Canvas, Sink
from localization.display.time_plots import Level, TimePlots
from localization.geometry import FloatArray
from localization.logs.ros_geometry import pose_from_message, pose_from_transform
from localization.logs.ros_stamps import stamp_from_message
from localization.maps.cloud import Cloud
from localization.types import SECOND, Pose
from teleop.operator import message_decoding as decode
from teleop.operator.display.banner_picture import draw_banner
from teleop.operator.display.camera_drawing import CameraDrawing
from teleop.operator.display.display_layout import LANE_COLOURS, LEGEND_TEXT, SERIES, blueprint
from teleop.operator.display.path_ahead import PathAhead, PathWhen
from teleop.operator.message_decoding import Message
from teleop.operator.robot_state.banner import Banner
from teleop.operator.robot_state.source_ages import STALE
from teleop.operator.robot_state.station_view import Pulse

HINT_SHOWN: Final = 10 * SECOND
"""Time for which a hint stays drawn after its verdict [ns]."""
_REMEMBERED: Final = 50
"""Number of poses kept for the comparison with ground truth, which may come earlier or later."""
SCAN_AFTER: Final = SECOND // 2
"""Time without a sweep in the map after which the scans are drawn around the robot [ns]."""
_SILENCE_SHOWN: Final = 2 * SECOND
"""Time by which the display goes on while the robot is silent [ns]."""
_NO_BOUNDS: Final = (np.array([-10.0, -10.0, 0.0]), np.array([10.0, 10.0, 3.0]))
"""Bounds of the view of a map that is not known yet [m]."""
_FLUSH: Final = 3.0
"""Largest time that closing waits for a viewer that accepts no data [s]."""

_log = logging.getLogger(__name__)


class Display:
    """Draws the robot's topics; see ``topics``."""

    def __init__(
        self,
        cloud: Cloud | None,
        *,
        sink: Sink,
        strict: bool = False,
        live: bool = False,
        camera: bool = False,
        path_ahead: PathWhen = "late",
    ) -> None:
        """Open the sink and draw the map, if there is one yet.

        Args:
            cloud: This side's copy of the robot's map; None if it comes later (see ``map``).
            sink: Where the display goes.
            strict: Whether to raise errors that are otherwise counted.
            live: Whether a person watches: the banner is shown, and a robot without a pose with its scans.
            camera: Whether to draw the camera of a robot that has one.
            path_ahead: When to draw where the robot will go.
        """
        self.failures: Counter[str] = Counter()
        """Number of messages that could not be drawn, by topic."""
        # rerun hides errors by default; here one place handles them all.
        rr.set_strict_mode(True)
        self._cloud, self._strict = cloud, strict
        self._live = live
        self._bounds = _NO_BOUNDS if cloud is None else cloud.bounds
        self._canvas = Canvas(sink, blueprint(*self._bounds, banner=live))
        self._scene = MapDrawing(self._canvas, cloud)
        self._instruments = TimePlots(self._canvas, LANE_COLOURS, SERIES, LEGEND_TEXT)
        self._ahead = PathAhead(self._canvas, path_ahead)
        self._now = 0
        self._frames: dict[str, Pose] = {}
        self._estimates: dict[int, FloatArray] = {}
        self._truths: dict[int, FloatArray] = {}
        self._control: tuple[str, str, bool] | None = None
        self._verdict_stamp, self._hint_until = -1, -1
        self._map_sha256: str | None = None
        self._drawn = cloud is not None
        self._mounts: dict[str, Pose] = {}
        self._swept: int | None = None
        self._floor, self._stale = 0, frozenset[str]()
        self._banner: Banner | None = None
        self._parked = live
        if live:
            self._at(0)
            self._scene.park()
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
            "/localization/candidates": self._candidates,
            "/teleop/state": self._teleop_state,
            "/drive_limits": self._ahead.limits,
        }
        if live:
            self._handlers |= {"/scan": self._scan, "/scan_vertical": self._scan}
        self._camera: CameraDrawing | None = None
        self._pictured = False
        if camera:
            self._camera = CameraDrawing(self._canvas, self._show_camera)
            self._handlers |= {
                "/camera/rgb/camera_info": self._camera.info,
                "/camera/rgb/image_rect_color/compressed": self._camera.picture,
                "/camera/depth/image_raw/compressed": self._camera.depth,
            }

    @property
    def topics(self) -> tuple[str, ...]:
        """Topics that it draws."""
        return tuple(self._handlers)

    def show(self, topic: str, message: Mapping[str, Any]) -> None:
        """Draw a message; those of topics that are not in ``topics`` are ignored.

        Args:
            topic: Name of the topic, such as ``/tf``.
            message: The message as decoded from rosbridge: dictionaries, lists or arrays of numbers, bytes.
        """
        if (handler := self._handlers.get(topic)) is None:
            return
        with self._guarded(topic):
            stamp = decode.stamp_of(message)
            handler(message, self._at(self._now if stamp is None else stamp))

    def command(self, forward: float, turn: float, deadman: bool, stamp: int) -> None:
        """Draw this operator's request: forward speed [m/s] and turn rate [rad/s], at a stamp [ns]."""
        with self._guarded("command"):
            self._at(stamp)
            self._instruments.plot("speed/stick", forward if deadman else 0.0)
            self._instruments.state("deadman", "held" if deadman else "released")
            self._ahead.sent(*((forward, turn) if deadman else (0.0, 0.0)))

    def hint(self, map_from_base: Pose, covariance: FloatArray, stamp: int) -> None:
        """Draw the hint that this operator sends: a pose and its covariance (6, 6) in ROS's order."""
        with self._guarded("hint"):
            self._at(stamp)
            self._scene.hint(map_from_base, "hint", np.asarray(covariance).reshape(6, 6))
            x, y, _ = map_from_base.position
            yaw = np.rad2deg(map_from_base.yaw)
            self._instruments.event(f"hint sent: x {x:.2f} m, y {y:.2f} m, heading {yaw:.0f}°")

    def link(self, *, connected: bool, text: str, stamp: int) -> None:
        """Draw that the connection was established or lost, and why, at a stamp [ns]."""
        with self._guarded("link"):
            self._at(stamp)
            if self._instruments.state("link", "connected" if connected else "lost"):
                text = f"link {'up' if connected else 'LOST'}: {text}"
            self._instruments.event(text, Level.INFO if connected else Level.ALARM)

    def map(self, cloud: Cloud) -> None:
        """Draw a map that came later, unless the robot's is known to be another one."""
        with self._guarded("map"):
            self._cloud = cloud
            if self._map_sha256 in (None, cloud.sha256):
                self._scene.map(cloud)
                self._drawn = True
            if self._map_sha256 is not None:
                self._compare_maps("the robot's map", self._map_sha256)

    def pulse(self, pulse: Pulse) -> None:
        """Grey out what is stale, and draw the banner; called some ten times a second by a station."""
        with self._guarded("pulse"):
            if pulse.silence > STALE:
                # Time goes on for a little, so that the silence is seen, and never beyond the robot's own by more:
                # the viewer stays at the latest time it knows.
                self._floor = max(self._floor, self._now + min(pulse.silence, _SILENCE_SHOWN))
                self._at(self._floor)
            if pulse.stale != self._stale:
                self._fade(pulse.stale)
            if pulse.banner != self._banner:
                self._banner = pulse.banner
                self._canvas.draw(
                    BANNER,
                    rr.EncodedImage(contents=draw_banner(pulse.banner), media_type="image/png"),
                )
            self._instruments.state("link", pulse.link)
            self._ahead.round_trip = pulse.round_trip
            if self._camera is not None:
                self._camera.age(self._now + pulse.silence)

    def _show_camera(self) -> None:
        """Make room for the pictures of a camera that is there."""
        self._pictured = True
        self._layout()

    def _layout(self) -> None:
        self._canvas.layout(blueprint(*self._bounds, banner=self._live, camera=self._pictured))

    def _fade(self, stale: frozenset[str]) -> None:
        """Draw what became stale in grey; what is fresh again is drawn when it comes."""
        self._scene.fade_body("/tf" in stale)
        if "/local_cloud" in stale:
            self._scene.fade_live()
        if "/scan" in stale:
            self._scene.fade_scans()
        for topic, lane in (("/localization/status", "health"), ("/teleop/state", "control")):
            if topic in stale and topic not in self._stale:
                self._instruments.state(lane, "stale")
                if lane == "health":
                    self._scene.health(palette.STALE)
        self._stale = stale

    def flush(self) -> None:
        """Send and write pending data at once, instead of within half a second."""
        with self._guarded("flush"):
            self._canvas.flush(_FLUSH)

    def close(self) -> None:
        """Send and write pending data, end the recording, and log how much could not be drawn."""
        if self.failures:
            _log.warning("could not draw %s", dict(self.failures))
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
                _log.warning("cannot draw %s (further errors are counted): %r", source, error)

    def _at(self, stamp: int) -> int:
        # What comes after a silence must not be hidden behind the time that went on meanwhile.
        self._canvas.set_time(max(stamp, self._floor))
        return stamp

    def _clock(self, message: Message, _: int) -> None:
        self._now = stamp_from_message(message["clock"])
        self._at(self._now)
        if self._camera is not None:
            self._camera.age(self._now)
        if 0 <= self._hint_until <= self._now:
            self._hint_until = -1
            self._scene.clear_hint()

    def _map_info(self, message: Message, _: int) -> None:
        self._map_sha256 = str(message["sha256"])
        if self._live:
            # The view of the map is set up by its bounds, before the map itself has been fetched.
            low, high = (np.array([message[end][axis] for axis in "xyz"]) for end in ("min", "max"))
            if not np.array_equal((low, high), self._bounds):
                self._bounds = low, high
                self._layout()
            if self._cloud is None or self._cloud.sha256 != self._map_sha256:
                self._instruments.state("map", "awaited")
                self._scene.clear_map()
                self._drawn = False
                return
        if self._cloud is not None:
            self._compare_maps(f"the robot's map {message['name']!r}", self._map_sha256)

    def _compare_maps(self, name: str, theirs: str) -> None:
        """Say whether the map that is drawn is the robot's; remove one that is not."""
        assert self._cloud is not None
        ours = self._cloud.sha256
        if theirs == ours:
            self._instruments.state("map", "verified")
            self._instruments.event(f"{name} is the one shown here ({ours[:12]})")
            if not self._drawn:
                self._scene.map(self._cloud)
            self._drawn = True
        elif not ours:
            self._instruments.state("map", "unverified")
            self._instruments.event(
                f"{name} ({theirs[:12]}) cannot be compared: the cloud shown here has no hash",
                Level.WARNING,
            )
        else:
            self._instruments.state("map", "other map")
            self._instruments.event(
                f"{name} ({theirs[:12]}) is NOT the one given here ({ours[:12]}), which is not drawn",
                Level.ALARM,
            )
            self._scene.clear_map()
            self._drawn = False

    def _tf_static(self, message: Message, _: int) -> None:
        for link in message["transforms"]:
            pose = pose_from_transform(link["transform"])
            parent, child = link["header"]["frame_id"], link["child_frame_id"]
            self._mounts[child] = pose
            self._scene.transform(parent, child, pose, static=True)

    def _tf(self, message: Message, stamp: int) -> None:
        moved = set()
        for link in message["transforms"]:
            pose = pose_from_transform(link["transform"])
            parent, child = link["header"]["frame_id"], link["child_frame_id"]
            stamp = self._at(decode.stamp_of(link) or stamp)
            self._frames[child] = pose
            self._scene.transform(parent, child, pose)
            moved.add(child)
        if self._live and "base_link" in moved and "odom" not in moved:
            if not self._parked:
                del self._frames["odom"]
                self._parked, self._swept = True, None
                self._scene.park()
                self._scene.clear_live()
            return
        self._parked = False
        if moved & {"odom", "base_link"} and {"odom", "base_link"} <= self._frames.keys():
            map_from_base = self._frames["odom"] @ self._frames["base_link"]
            self._scene.estimate.add(map_from_base.position)
            self._compare(self._estimates, self._truths, stamp, map_from_base.position)
            self._ahead.draw(stamp)

    def _ground_truth(self, message: Message, stamp: int) -> None:
        position = pose_from_message(message["pose"]["pose"]).position
        self._scene.truth.add(position)
        self._compare(self._truths, self._estimates, stamp, position)

    def _compare(
        self,
        mine: dict[int, FloatArray],
        other: dict[int, FloatArray],
        stamp: int,
        position: FloatArray,
    ) -> None:
        """Plot the distance of estimate and ground truth once both of a stamp are known."""
        if (twin := other.pop(stamp, None)) is not None:
            error = 1e3 * float(np.linalg.norm(position - twin))
            self._instruments.plot("position/error", error)
            return
        mine[stamp] = position
        if len(mine) > _REMEMBERED:
            del mine[next(iter(mine))]

    def _local_cloud(self, message: Message, stamp: int) -> None:
        if self._parked:
            return  # of a pose that is gone
        self._swept = stamp
        self._scene.live(*decode.cloud_of(message))
        self._scene.clear_scans()

    def _scan(self, message: Message, stamp: int) -> None:
        """Draw a scan around the robot while no sweep is placed in the map."""
        if self._swept is not None and stamp - self._swept <= SCAN_AFTER:
            return
        scanner = str(message["header"]["frame_id"])
        mount = self._mounts.get(scanner)
        if mount is not None:
            colour = palette.YELLOW if scanner == "laser_vertical" else palette.WHITE
            self._scene.scan(scanner, mount.apply(decode.scan_points(message)), colour)

    def _amcl_pose(self, message: Message, _: int) -> None:
        self._scene.uncertainty(
            pose_from_message(message["pose"]["pose"]),
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
            return  # latched, so that it is sent again on every new connection
        self._verdict_stamp = stamp
        verdict, hint = str(message["verdict"]), pose_from_message(message["hint"])
        candidates = [pose_from_message(pose) for pose in message["candidates"]]
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

    def _candidates(self, message: Message, _: int) -> None:
        self._scene.hypotheses([pose_from_message(pose).position for pose in message["poses"]])

    def _teleop_state(self, message: Message, stamp: int) -> None:
        self._ahead.state(message, stamp)
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
