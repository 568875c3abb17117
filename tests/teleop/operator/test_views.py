"""What the operator sees: the drive in the real viewer, drawn in software, looked at pixel by pixel."""

from __future__ import annotations

import io
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rerun.experimental import ViewerClient

from localization.display.colours import ORANGE, SKY, Colour
from localization.types import SECOND
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
