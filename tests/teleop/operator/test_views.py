"""What the operator sees: the drive in the real viewer, drawn in software, looked at pixel by pixel."""

from __future__ import annotations

import contextlib
import io
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rerun.experimental import ViewerClient

from localization.display.colours import GREEN, ORANGE, RED, SKY, STALE, Colour
from localization.display.rerun_sink import Sink
from localization.maps.cloud import Cloud
from localization.types import SECOND
from teleop.operator.display.display import Display
from teleop.operator.display.restarting_display import RestartingDisplay
from teleop.operator.robot_state.event_list import EventList
from teleop.operator.robot_state.station_view import StationView
from tests.teleop.operator.robot_state.test_robot_run import clock, control, map_info, status, tf
from tests.teleop.operator.support import headless_viewer

_RED: Colour = (222, 62, 38)
_TEAL: Colour = (33, 145, 140)


def _pixels(picture: np.ndarray, colour: Colour, tolerance: int = 40) -> int:
    """Return how many pixels are near a colour; edges and shading blend."""
    return int((np.abs(picture.astype(int) - colour).max(axis=-1) < tolerance).sum())


def _shot(viewer: ViewerClient, view_id: str | None = None) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(viewer.take_screenshot(view_id))).convert("RGB"))


def _load(viewer: ViewerClient, recording: Path) -> None:
    viewer.open(str(recording))
    for _ in range(300):
        state = viewer.get_state()
        ends = [t.end for r in state.recordings for t in r.timelines]
        if not state.loading and ends and max(end or 0 for end in ends) >= 12 * SECOND:
            return
        time.sleep(0.1)
    raise TimeoutError("the viewer does not load the recording")


@pytest.mark.long
@pytest.mark.process
@pytest.mark.slow
def test_the_operator_sees_map_live_cloud_robot_path_and_hint(
    recording: Path, tmp_path: Path
) -> None:
    with headless_viewer() as process:
        viewer = process.client
        _load(viewer, recording)
        shots = {}
        for name, seconds in (("waiting", 0.9), ("hint", 1.2), ("drive", 11.8)):
            viewer.set_time("robot time", duration=seconds, play_state="paused")
            viewer.take_screenshot()
            views = {view.name.split()[0]: view for view in viewer.get_state().views}
            assert {name for name, view in views.items() if view.reports} == set()
            for which in ("World", "Close-up"):
                shots[name, which] = _shot(viewer, views[which].view_id)
            Image.fromarray(_shot(viewer)).save(tmp_path / f"{name}.png")
    assert set(views) == {
        *("World", "Close-up", "States", "Events", "Legend"),
        *("Position", "Fit", "NIS", "Speed"),
    }
    for which in ("World", "Close-up"):
        drive, waiting = shots["drive", which], shots["waiting", which]
        grey = (np.ptp(drive.astype(int), axis=-1) < 12) & (drive.max(axis=-1) > 60)
        assert grey.mean() > 0.02, f"{which}: the map"
        assert _pixels(drive, _TEAL) > 200, f"{which}: the live cloud"
        assert _pixels(drive, _RED) > 30, f"{which}: the robot"
        assert _pixels(drive, SKY) > 100, f"{which}: its path"
        assert _pixels(waiting, _RED) == 0, f"{which}: no robot before it is placed"
    assert _pixels(shots["hint", "World"], ORANGE) > 50
    assert _pixels(shots["waiting", "World"], ORANGE) == 0


@pytest.mark.process
@pytest.mark.slow
def test_viewer_shows_the_newest_run_with_its_banner(cloud: Cloud) -> None:
    with headless_viewer() as process:
        viewer = process.client
        display = RestartingDisplay(
            lambda run: Display(None, sink=Sink(viewer=process.url), strict=True, live=True)
        )
        for run_id, state, colour, ends in (
            ("a1", "estop", RED, (20, 22)),
            ("b2", "idle", STALE, (0, 2)),
        ):
            view = StationView(EventList())
            view.connection(True, "ws://robot", 0)
            display.show("/map_info", map_info(run_id))
            display.map(cloud)
            for seconds in range(*ends):
                now = seconds * SECOND
                for topic, message in (
                    ("/clock", clock(now)),
                    ("/tf", tf(now)),
                    ("/localization/status", status(now)),
                    ("/teleop/state", control(state, "by ann")),
                ):
                    view.received(topic, message, now)
                    display.show(topic, message)
            # An e-stop at once, and a robot that has been silent for half a second.
            late = now + (0 if state == "estop" else SECOND // 2)
            display.pulse(view.pulse(late))
            picture = _banner(viewer, colour)
            assert _pixels(picture, colour) > 0.3 * picture.shape[0] * picture.shape[1]
        assert _pixels(picture, RED) == 0
        assert _pixels(picture, GREEN) == 0
        display.close()


def _banner(viewer: ViewerClient, colour: Colour) -> np.ndarray:
    """Return the picture of the banner once it has a colour; what it is at last, if it never has."""
    picture = np.zeros((1, 1, 3))
    for _ in range(100):
        views = {view.name: view for view in viewer.get_state().views}
        # The views of a run that ends are gone between the list and the picture.
        with contextlib.suppress(ConnectionError):
            if "Now" in views:
                picture = _shot(viewer, views["Now"].view_id)
        if _pixels(picture, colour) > 1000:
            break
        time.sleep(0.1)
    return picture
