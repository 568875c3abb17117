"""Where the display goes: into a file, to a viewer on this or another machine, or both."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings

APPLICATION = "farsteer"
"""The viewer keeps its layouts by this name."""

_LIVE_TICK = 0.04
"""How long data may wait to be sent to a viewer [s]."""
_FILE_TICK = 0.5
"""How long it may wait to be written, if nobody looks [s]; longer makes smaller files."""


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


def open_stream(sink: Sink, blueprint: rrb.Blueprint) -> rr.RecordingStream:
    """Return a recording that flows into the sink and has the blueprint for its layout."""
    viewer = sink.viewer
    if sink.spawn:
        _spawn(sink.port)
        viewer = f"rerun+http://127.0.0.1:{sink.port}/proxy"
    stream = rr.RecordingStream(
        APPLICATION,
        batcher_config=rr.ChunkBatcherConfig(
            flush_tick=_FILE_TICK if viewer is None else _LIVE_TICK
        ),
    )
    # All times are the robot's; when this machine got to log them says nothing.
    stream.set_log_time_enabled(False)
    sinks: list[rr.FileSink | rr.GrpcSink] = []
    if sink.file is not None:
        sink.file.parent.mkdir(parents=True, exist_ok=True)
        # The index that goes to the file's end takes some 50 MB of memory an hour. A kill loses the
        # index and nothing else: `rerun rrd optimize` makes a new one.
        sinks.append(rr.FileSink(sink.file, write_footer=True))
    if viewer is not None:
        sinks.append(rr.GrpcSink(viewer))
    stream.set_sinks(*sinks, default_blueprint=blueprint)
    return stream


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
