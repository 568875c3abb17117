"""Records what the robot publishes, as one file that the console can play: on a thread, for disks may be slow."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from queue import Empty, Full, Queue
from typing import Final, NamedTuple

from localization.logs.mcap_file import McapFile
from teleop.rosbridge.graph.topic import Monitor, Topic
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.messages.ros_serialization import RosSerializer
from teleop.rosbridge.protocol.protocol import Protocol

SURFACES: Final = "map.glb"
"""Name of the attachment that holds the map's surfaces, so that a run can be looked at where there is no robot."""

PERIODS: Final = {
    # What the console shows.
    **dict.fromkeys(("/map_info", "/tf_static", "/robot_description"), 0.0),
    **dict.fromkeys(("/teleop/state", "/bumper_state", "/diagnostics"), 0.0),
    **dict.fromkeys(("/localization/status", "/localization/candidates"), 0.0),
    **dict.fromkeys(("/localization/hint_verdict", "/ground_truth/odom"), 0.0),
    **dict.fromkeys(("/tf", "/amcl_pose"), 0.0),
    **dict.fromkeys(("/local_cloud", "/teleop/guard"), 0.19),
    "/camera/rgb/image_rect_color/compressed": 0.49,
    # What a localiser reads.
    **dict.fromkeys(("/scan", "/scan_vertical", "/joint_states", "/imu/data"), 0.0),
}
"""Topics that are recorded, and the shortest time between two messages of each [s].

Clouds and the guard's zone five times and pictures twice a second: more would be most of the file, and show hardly more.
"""

_STEP: Final = 16_000_000
"""Each time a run has grown by so much, room is made for it [bytes]."""

_WAITING: Final = 4000
"""Messages that may wait for the disk: those of some ten seconds."""


class _Written(NamedTuple):
    topic: Topic
    message: Message
    time: int


class RunRecorder:
    """One run, from its making until ``close``; it ends by itself when the disk takes no more."""

    def __init__(
        self,
        protocol: Protocol,
        path: Path,
        stamp: Callable[[], int],
        surfaces: bytes | None,
        ended: Callable[[str], object],
        *,
        most: int,
        grown: Callable[[], object] = lambda: None,
    ) -> None:
        """Begin to record.

        Args:
            protocol: The protocol of the robot's server.
            path: The file.
            stamp: Returns the time of the robot's clock [ns].
            surfaces: The map's surfaces, which are attached; None if there are none.
            ended: Called on the recorder's thread with the reason if it ends by itself.
            most: Largest size of the file [bytes].
            grown: Called on the recorder's thread at the beginning and each 16 MB, to make room.

        Raises:
            OSError: If the file cannot be written.
        """
        self._topics, self._stamp, self._ended = protocol.topics, stamp, ended
        self._most, self._grown = most, grown
        self._serializer = RosSerializer(protocol.registry, "ros2")
        self._file = McapFile(path)
        if surfaces is not None:
            self._file.attach(SURFACES, "model/gltf-binary", surfaces)
        self._queue: Queue[_Written] = Queue(_WAITING)
        self._closing = threading.Event()
        self._late = False
        self._monitors: list[tuple[str, Monitor]] = []
        for name, period in PERIODS.items():
            topic = self._topics.find(name)
            if topic is not None and topic.owned:
                monitor = self._monitor(topic, round(period * 1e9))
                self._monitors.append((name, monitor))
                self._topics.monitor(name, topic.kind.name, monitor)
        self._thread = threading.Thread(target=self._write, name="run", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Complete the file; further calls have no effect."""
        for name, monitor in self._monitors:
            self._topics.unmonitor(name, monitor)
        self._monitors = []
        self._closing.set()
        self._thread.join()

    def _monitor(self, topic: Topic, period: int) -> Monitor:
        last = -period

        def take(message: Message, now: int) -> None:
            nonlocal last
            stamp = self._stamp()
            if stamp - last < period and last <= stamp:
                return
            last = stamp
            try:
                self._queue.put_nowait(_Written(topic, message, stamp))
            except Full:
                self._late = True
                self._closing.set()

        return take

    def _write(self) -> None:
        why, room_at = "", 0
        try:
            while not (self._closing.is_set() and self._queue.empty()):
                try:
                    topic, message, time = self._queue.get(timeout=0.1)
                except Empty:
                    continue
                kind = topic.kind
                self._file.add(
                    topic.name,
                    kind.name,
                    partial(self._serializer.definition, kind),
                    self._serializer.bytes(kind, message),
                    time,
                )
                if self._file.size >= room_at:
                    room_at = self._file.size + _STEP
                    self._grown()
                if self._file.size > self._most:
                    why = f"it has reached {self._most / 1e9:.3g} GB, the most that it may have"
                    break
            self._file.close()
            self._grown()
        except OSError as error:
            self._file.abandon()
            why = f"{error.strerror or error}; what was recorded before can be looked at"
        if self._late:
            why = "the disk is too slow"
        if why:
            self._ended(why)
