"""A file of ROS 2 messages (MCAP) on a disk that may fail: what it took stays readable."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from mcap.writer import Writer

_CHUNK_SIZE: Final = 256 * 1024
"""Size of a chunk before compression [bytes]: a few seconds of readings, which is what a kill may lose."""


class McapFile:
    """Writes messages that are serialised already."""

    def __init__(self, path: Path) -> None:
        """Begin a file, replacing one of that name; its folder is made if it is missing."""
        self._path, self._whole = path, 0
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._counts: dict[int, int] = {}
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("wb")
        self._writer = Writer(self._file, chunk_size=_CHUNK_SIZE)
        self._writer.start(profile="ros2", library="farsteer")

    @property
    def size(self) -> int:
        """What has been written so far [bytes]."""
        return self._whole

    def note(self, name: str, notes: Mapping[str, str]) -> None:
        """Add metadata."""
        self._writer.add_metadata(name, dict(notes))

    def attach(self, name: str, media_type: str, content: bytes) -> None:
        """Attach a file."""
        self._writer.add_attachment(0, 0, name, media_type, content)

    def add(
        self, topic: str, kind: str, definition: Callable[[], str], cdr: bytes, log_time: int
    ) -> None:
        """Append a message.

        Args:
            topic: Its topic.
            kind: Its type, such as ``sensor_msgs/msg/Imu``.
            definition: Returns the type's definition; called for the first message of a type.
            cdr: The message, serialised.
            log_time: Time of reception [ns].

        Raises:
            OSError: If the disk takes no more; ``abandon`` then keeps what it has taken.
        """
        if topic not in self._channels:
            if kind not in self._schemas:
                text = definition().encode()
                self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", text)
            self._channels[topic] = self._writer.register_channel(topic, "cdr", self._schemas[kind])
        channel = self._channels[topic]
        self._counts[channel] = sequence = self._counts.get(channel, 0) + 1
        self._writer.add_message(channel, log_time, cdr, publish_time=log_time, sequence=sequence)
        self._file.flush()
        self._whole = self._file.tell()

    def close(self) -> None:
        """Complete the file; further calls have no effect."""
        if self._file.closed:
            return
        try:
            self._writer.finish()
        finally:
            self._file.close()

    def abandon(self) -> None:
        """End the file after a write that failed."""
        with contextlib.suppress(OSError):
            self._file.close()  # tries to write the rest once more
        with contextlib.suppress(OSError):
            os.truncate(self._path, self._whole)
