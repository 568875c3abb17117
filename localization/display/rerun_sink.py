"""Where the display goes: into a file, to a viewer on this or another machine, or both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from uuid import UUID, uuid4

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings

from localization.display.entity_paths import TIMELINE

APPLICATION = "farsteer"
"""The viewer keeps its layouts by this name."""

_LIVE_TICK = 0.04
"""How long data may wait to be sent to a viewer [s]."""
_FILE_TICK = 0.5
"""How long it may wait to be written, if nobody looks [s]; longer makes smaller files."""


_PATIENCE = 4.0
"""How long a viewer may take to answer at the beginning [s]."""


class SinkError(RuntimeError):
    """The display cannot go where it should; the message says what would work."""


@dataclass(frozen=True, slots=True)
class Sink:
    """At least one of file, viewer and spawn."""

    file: Path | None = None
    """An ``.rrd`` to write; an existing one is replaced. Readable at any time, also after a kill."""
    viewer: str | None = None
    """A running viewer, such as ``rerun+http://127.0.0.1:9876/proxy``."""
    spawn: bool = False
    """Start a viewer here, which nobody else can reach, and which outlives the display."""
    port: int = 9876
    """Of the spawned viewer; one that already listens there is used."""

    def __post_init__(self) -> None:
        if self.file is None and self.viewer is None and not self.spawn:
            raise ValueError("the display needs a sink: a file, a viewer's address, or spawn=True")
        if self.viewer is not None and self.spawn:
            raise ValueError("viewer and spawn exclude each other: is there a viewer or not?")


class Canvas:
    """Draws the same into every part of a sink.

    Each part has a stream of its own: with both on one, a viewer that hangs would hold up the file.
    """

    def __init__(self, sink: Sink, blueprint: rrb.Blueprint) -> None:
        """Open the sink, with the blueprint for the layout of its views.

        Raises:
            SinkError: if the viewer does not answer.
        """
        recording = uuid4()
        viewer = sink.viewer
        if sink.spawn:
            _spawn(sink.port)
            viewer = f"rerun+http://127.0.0.1:{sink.port}/proxy"
        self._streams: list[rr.RecordingStream] = []
        if sink.file is not None:
            sink.file.parent.mkdir(parents=True, exist_ok=True)
            # The index that goes to the file's end takes some 50 MB of memory an hour. A kill loses the
            # index and nothing else: `rerun rrd optimize` makes a new one.
            self._open(recording, rr.FileSink(sink.file, write_footer=True), _FILE_TICK, blueprint)
        if viewer is not None:
            # rerun's own patience with a viewer that accepts and says nothing has no end.
            given = rr.GrpcSink(viewer), _LIVE_TICK, blueprint
            if not _in_time(lambda: self._open(recording, *given), _PATIENCE):
                rr.unregister_shutdown()
                raise SinkError(
                    f"no viewer answers at {viewer}: start one with `rerun --bind 127.0.0.1`, or let the "
                    "display spawn its own"
                )

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
        # All times are the robot's; when this machine got to log them says nothing.
        stream.set_log_time_enabled(False)
        stream.set_sinks(sink, default_blueprint=blueprint)
        self._streams.append(stream)

    def set_time(self, stamp: int) -> None:
        """Set the time of what is drawn next: the robot's [ns]."""
        time = np.timedelta64(stamp, "ns")
        for stream in self._streams:
            stream.set_time(TIMELINE, duration=time)

    def draw(self, entity: str, what: rr.AsComponents, *, static: bool = False) -> None:
        """Draw something: from now on, or ``static`` for all times."""
        for stream in self._streams:
            stream.log(entity, what, static=static)

    def flush(self, timeout: float) -> None:
        """Send and write what waits.

        Args:
            timeout: how long to try, for each part [s].

        Raises:
            RuntimeError: if a viewer is gone or too slow.
        """
        for stream in self._streams:
            stream.flush(timeout_sec=timeout)

    def close(self, timeout: float) -> None:
        """End the recording.

        Args:
            timeout: how long to try, for each part [s].

        Raises:
            RuntimeError: if a viewer is gone or too slow. The file is whole nevertheless.
        """
        # rerun waits for ever for a viewer that hangs: when a stream ends, and when the interpreter does.
        rr.unregister_shutdown()
        try:
            self.flush(timeout)
        finally:
            for stream in self._streams:
                _in_time(stream.disconnect, timeout)


def _in_time(call: Callable[[], None], timeout: float) -> bool:
    """Call, but wait for its end no longer than so [s]; return whether it came."""
    thread = Thread(target=call, daemon=True)
    thread.start()
    thread.join(timeout)
    return not thread.is_alive()


def viewer_program() -> Path:
    """Return the viewer that came with the SDK: it need not be on the search path."""
    spec = find_spec("rerun_cli")
    if spec is None or spec.origin is None:
        raise FileNotFoundError("rerun-sdk came without its viewer: install the wheel from PyPI")
    return Path(spec.origin).with_name("rerun")


def _spawn(port: int) -> None:
    # rerun.spawn() would let the viewer listen on every network.
    rerun_bindings.spawn(
        port=port,
        hide_welcome_screen=True,
        executable_path=str(viewer_program()),
        extra_args=["--bind", "127.0.0.1"],
        extra_env=[("RERUN_APP_ONLY", "true")],
    )
