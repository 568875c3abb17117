"""What each process imports: it pays for that in time to start, and in memory."""

from __future__ import annotations

import subprocess
import sys

import pytest

MAPS = {"numba", "scipy", "kiss_icp"}


@pytest.mark.process
@pytest.mark.parametrize("process", ["gateway", "control", "camera"])
def test_process_other_than_the_estimator_imports_no_library_of_maps(process: str) -> None:
    code = f"import teleop.robot.real_time.{process}_process, sys; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert not MAPS & set(loaded.stdout.split())
