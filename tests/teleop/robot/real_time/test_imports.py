"""What the processes load when they start: each pays in time and memory for its own."""

from __future__ import annotations

import subprocess
import sys

import pytest

MAPS = {"numba", "scipy", "kiss_icp"}


@pytest.mark.process
@pytest.mark.parametrize("process", ["gateway", "control", "camera"])
def test_only_the_estimator_loads_libraries_of_maps(process: str) -> None:
    code = f"import teleop.robot.real_time.{process}_process, sys; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert not MAPS & set(loaded.stdout.split())
