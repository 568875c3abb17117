from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from robot_sim.cameras import CAMERAS, CameraFrame
from robot_sim.cameras.camera_frame import measured_depth


def metres(*values: float) -> npt.NDArray[np.float32]:
    return np.array(values, dtype=np.float32)


def test_depth_beyond_the_range_is_not_measured() -> None:
    seen = measured_depth(metres(0.49, 0.5, 3.0, 10.0, 10.1), 0.5, 10.0, 0.0)

    np.testing.assert_array_equal(np.isnan(seen), [True, False, False, False, True])
    np.testing.assert_array_equal(seen[1:4], metres(0.5, 3.0, 10.0))


def test_the_kinect_resolves_3_mm_at_1_m_and_7_cm_at_5_m() -> None:
    kinect = CAMERAS["kinect"]
    for distance, step in ((1.0, 0.003), (5.0, 0.07)):
        true = np.linspace(distance - 0.2, distance + 0.2, 4001, dtype=np.float32)
        seen = np.unique(measured_depth(true, kinect.near, kinect.far, kinect.depth_step))
        gaps = np.diff(seen)
        assert gaps.mean() == pytest.approx(step, rel=0.1)
        error = measured_depth(true, 0.5, 10.0, kinect.depth_step) - true
        assert np.abs(error).max() <= 0.56 * gaps.max()


def test_depth_in_millimetres_is_zero_where_nothing_was_measured() -> None:
    frame = CameraFrame(0, np.zeros((1, 3, 3), np.uint8), metres(np.nan, 1.2345, 70.0)[None])

    np.testing.assert_array_equal(frame.depth_mm, [[0, 1235, 65535]])
    assert frame.depth_mm.dtype == np.uint16
