"""Output of a rerun display: into a file, to a viewer on this or another machine, or both."""

from __future__ import annotations

import socket
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from urllib.parse import urlsplit
from uuid import UUID, uuid4

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings

from localization.display.entity_paths import TIMELINE
from localization.errors import LocalizationError

APPLICATION = "farsteer"
"""Application name, under which the viewer stores its layouts."""

_LIVE_TICK = 0.04
"""Time that data may wait before it is sent to a viewer [s]."""
_FILE_TICK = 0.5
"""Time that data may wait before it is written to a file [s]; longer times give smaller files."""


_PATIENCE = 4.0
"""Time within which a viewer must answer at the beginning [s]."""


class SinkError(LocalizationError):
    """A sink that cannot be opened; the message names what would work."""


@dataclass(frozen=True, slots=True)
class Sink:
    """Destination of a display; at least one of file, viewer and spawn must be given."""

    file: Path | None = None
    """File ``.rrd`` to write; an existing one is replaced. It is readable at any time, also after a kill."""
    viewer: str | None = None
    """Address of a running viewer, such as ``rerun+http://127.0.0.1:9876/proxy``."""
    spawn: bool = False
    """Whether to start a viewer on this machine, which listens only locally and outlives the display."""
    port: int = 9876
    """Port of the spawned viewer; a viewer that already listens there is used."""

    def __post_init__(self) -> None:
        if self.file is None and self.viewer is None and not self.spawn:
            raise ValueError("the display needs a sink: a file, a viewer's address, or spawn=True")
        if self.viewer is not None and self.spawn:
            raise ValueError(
                "viewer and spawn exclude each other: give a running viewer, or spawn one"
            )


class Canvas:
    """Draws the same into every destination of a sink.

    Each destination has a stream of its own, so that a viewer that hangs does not delay the file.
    """

    def __init__(self, sink: Sink, blueprint: rrb.Blueprint) -> None:
        """Open the sink.

        Args:
            sink: Destination of the display.
            blueprint: Layout of the views.

        Raises:
            OSError: If the file cannot be written.
            SinkError: If the viewer does not answer.
        """
        recording = uuid4()
        viewer = sink.viewer
        if sink.spawn:
            _spawn(sink.port)
            viewer = f"rerun+http://127.0.0.1:{sink.port}/proxy"
        self._streams: list[rr.RecordingStream] = []
        if sink.file is not None:
            sink.file.parent.mkdir(parents=True, exist_ok=True)
            sink.file.open("wb").close()  # rerun raises a bare RuntimeError
            # The index at the file's end takes some 50 MB of memory an hour. A kill loses only the index:
            # `rerun rrd optimize` rebuilds it.
            self._open(recording, rr.FileSink(sink.file, write_footer=True), _FILE_TICK, blueprint)
        if viewer is not None:
            if sink.viewer is not None and not _listens(viewer):
                raise _no_viewer(viewer)
            # rerun itself would wait forever for a viewer that accepts the connection and never answers.
            given = rr.GrpcSink(viewer), _LIVE_TICK, blueprint
            if not _in_time(lambda: self._open(recording, *given), _PATIENCE):
                rr.unregister_shutdown()
                raise _no_viewer(viewer)

    def _open(
        self,
        recording: UUID,
        sink: rr.FileSink | rr.GrpcSink,
        tick: float,
        blueprint: rrb.Blueprint,
    ) -> None:
        stream = rr.RecordingStream(
            APPLICATION,
            recording_id=recording,
            batcher_config=rr.ChunkBatcherConfig(flush_tick=tick),
        )
        # All times are the robot's; the time of logging on this machine is irrelevant.
        stream.set_log_time_enabled(False)
        stream.set_sinks(sink, default_blueprint=blueprint)
        self._streams.append(stream)

    def set_time(self, stamp: int) -> None:
        """Set the robot's time [ns] of the following drawings."""
        time = np.timedelta64(stamp, "ns")
        for stream in self._streams:
            stream.set_time(TIMELINE, duration=time)

    def draw(self, entity: str, what: rr.AsComponents, *, static: bool = False) -> None:
        """Draw components under an entity path: from the present time on, or ``static`` for all times."""
        for stream in self._streams:
            stream.log(entity, what, static=static)

    def layout(self, blueprint: rrb.Blueprint) -> None:
        """Replace the layout of the views."""
        for stream in self._streams:
            stream.send_blueprint(blueprint)

    def flush(self, timeout: float) -> None:
        """Send and write buffered data.

        Args:
            timeout: Time limit for each destination [s].

        Raises:
            RuntimeError: If a viewer is gone or too slow.
        """
        for stream in self._streams:
            stream.flush(timeout_sec=timeout)

    def close(self, timeout: float) -> None:
        """End the recording.

        Args:
            timeout: Time limit for each destination [s].

        Raises:
            RuntimeError: If a viewer is gone or too slow. The file is complete nevertheless.
        """
        # rerun waits forever for a viewer that hangs, when a stream ends and when the interpreter exits.
        rr.unregister_shutdown()
        try:
            self.flush(timeout)
        finally:
            for stream in self._streams:
                _in_time(stream.disconnect, timeout)


def _no_viewer(viewer: str) -> SinkError:
    return SinkError(
        f"no viewer answers at {viewer}: start one with `rerun --bind 127.0.0.1`, or let the display spawn one"
    )


def _listens(viewer: str) -> bool:
    """Return whether anything listens at a viewer's address; True if it names no port, as rerun knows what it means.

    rerun retries for eleven seconds, and meanwhile the process can open no other viewer.
    """
    try:
        address = urlsplit(viewer)
        host, port = address.hostname, address.port
    except ValueError:
        return True
    if host is None or port is None:
        return True
    try:
        with socket.create_connection((host, port), timeout=_PATIENCE):
            return True
    except OSError:
        return False


def _in_time(call: Callable[[], None], timeout: float) -> bool:
    """Run a call in a thread; return whether it ended within ``timeout`` [s]."""
    thread = Thread(target=call, daemon=True)
    thread.start()
    thread.join(timeout)
    return not thread.is_alive()


def viewer_program() -> Path:
    """Return the viewer that is installed with the SDK; it need not be on the search path."""
    spec = find_spec("rerun_cli")
    if spec is None or spec.origin is None:
        raise FileNotFoundError(
            "rerun-sdk is installed without its viewer: install the wheel from PyPI"
        )
    return Path(spec.origin).with_name("rerun")


def _spawn(port: int) -> None:
    # rerun.spawn() would make the viewer listen on all networks.
    rerun_bindings.spawn(
        port=port,
        hide_welcome_screen=True,
        executable_path=str(viewer_program()),
        extra_args=["--bind", "127.0.0.1"],
        extra_env=[("RERUN_APP_ONLY", "true")],
    )
