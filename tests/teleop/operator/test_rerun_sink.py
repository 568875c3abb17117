"""Where the display goes: files that survive a kill, viewers that may vanish."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from localization.display.rerun_sink import Sink, SinkError, viewer_program
from localization.maps.cloud import Cloud
from localization.types import SECOND
from teleop.operator.display.display import Display
from tests.teleop.operator.support import Moment, column, headless_viewer, play, rows

_LEAVE = """
import sys
import numpy as np
from localization.maps.cloud import Cloud
from teleop.operator.display.display import Display
from localization.display.rerun_sink import Sink, SinkError
points = np.random.default_rng(0).uniform(0.0, 3.0, (100_000, 3))
cloud = Cloud(points, np.tile([0.0, 0.0, 1.0], (100_000, 1)), name="x")
try:
    display = Display(cloud, sink=Sink(viewer=sys.argv[1]))
except SinkError:
    sys.exit()
for i in range(10_000):
    display.command(0.001 * i, 0.0, True, i * 10_000_000)
display.close()
"""
_RECORD = """
import sys, time
from pathlib import Path
import numpy as np
from localization.maps.cloud import Cloud
from teleop.operator.display.display import Display
from localization.display.rerun_sink import Sink
points = np.random.default_rng(0).uniform(0.0, 3.0, (1000, 3))
cloud = Cloud(points, np.tile([0.0, 0.0, 1.0], (1000, 1)), name="x")
display = Display(cloud, sink=Sink(file=Path(sys.argv[1])), strict=True)
for i in range(100_000):
    display.command(0.001 * i, 0.0, True, i * 10_000_000)
    time.sleep(0.001)
"""


def _rrd(*arguments: str | Path) -> bool:
    command = [str(viewer_program()), "rrd", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def test_a_sink_leads_somewhere() -> None:
    with pytest.raises(ValueError, match="needs a sink"):
        Sink()
    with pytest.raises(ValueError, match="exclude each other"):
        Sink(viewer="rerun+http://127.0.0.1:9876/proxy", spawn=True)


@pytest.mark.slow
def test_a_closed_recording_is_whole(recording: Path) -> None:
    assert _rrd("verify", recording)


@pytest.mark.process
def test_a_killed_process_leaves_a_readable_recording(tmp_path: Path) -> None:
    path = tmp_path / "killed.rrd"
    process = subprocess.Popen([sys.executable, "-c", _RECORD, path], cwd=Path(__file__).parents[3])
    try:
        for _ in range(600):
            time.sleep(0.1)
            if path.exists() and path.stat().st_size > 60_000:
                break
        time.sleep(1.5)
        assert process.poll() is None
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert _rrd("verify", "--check-footers=false", path)
    mended = tmp_path / "mended.rrd"
    assert _rrd("optimize", path, "-o", mended)
    assert _rrd("verify", mended)
    speeds = column(mended, "plots/speed/stick", "Scalars:scalars")
    assert len(speeds) > 300
    assert speeds == [[pytest.approx(0.001 * i)] for i in range(len(speeds))]


@pytest.mark.process
def test_file_and_viewer_get_the_same(
    moments: list[Moment], office_cloud: Cloud, tmp_path: Path
) -> None:
    with headless_viewer() as viewer:
        sink = Sink(file=tmp_path / "both.rrd", viewer=viewer.url)
        display = Display(office_cloud, sink=sink, strict=True)
        play(moments[:200], display)
        display.close()
        timelines = [t for r in viewer.client.get_state().recordings for t in r.timelines]
    assert [(t.name, t.end) for t in timelines] == [("robot time", 4 * SECOND)]
    assert "map/odom/base_link/body/chassis" in rows(tmp_path / "both.rrd")


@pytest.mark.long
@pytest.mark.process
@pytest.mark.parametrize("end", [signal.SIGSTOP, signal.SIGKILL])
def test_hung_or_dead_viewer_stops_neither_client_nor_file(
    moments: list[Moment], office_cloud: Cloud, tmp_path: Path, end: signal.Signals
) -> None:
    path = tmp_path / "both.rrd"
    with headless_viewer() as viewer:
        display = Display(office_cloud, sink=Sink(file=path, viewer=viewer.url))
        play(moments[:100], display)
        os.kill(viewer.pid, end)
        begun = time.monotonic()
        play(moments[100:], display)
        assert time.monotonic() - begun < 10.0
        display.close()
        assert time.monotonic() - begun < 30.0
    assert rows(path)["map/odom/base_link"] > 250
    assert _rrd("verify", path)
    assert not {source for source in display.failures if source != "close"}


@pytest.mark.long
@pytest.mark.process
def test_a_process_ends_although_its_viewer_hangs() -> None:
    with headless_viewer() as viewer:
        os.kill(viewer.pid, signal.SIGSTOP)
        command = [sys.executable, "-c", _LEAVE, viewer.url]
        subprocess.run(command, cwd=Path(__file__).parents[3], check=True, timeout=60)


def test_a_viewer_that_is_not_there_is_missed_at_once(cloud: Cloud, tmp_path: Path) -> None:
    begun = time.monotonic()
    with pytest.raises(SinkError, match="no viewer answers at"):
        Display(cloud, sink=Sink(viewer="rerun+http://127.0.0.1:9/proxy"))
    assert time.monotonic() - begun < 10.0


def test_a_file_that_cannot_be_written_is_named(cloud: Cloud, tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError, match=str(tmp_path)):
        Display(cloud, sink=Sink(file=tmp_path))
