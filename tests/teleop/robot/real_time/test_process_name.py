"""The names by which ``ps`` shows the processes of a robot."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.teleop.robot.real_time.test_end_of_driving import served

pytestmark = [pytest.mark.process, pytest.mark.slow]


def shown(pid: int) -> str:
    """Return the name of a process."""
    return Path(f"/proc/{pid}/comm").read_text().strip()


def test_processes_of_a_robot_have_their_names(tmp_path: Path) -> None:
    with served(tmp_path / "drive.mcap") as (robot, _):
        children = Path(f"/proc/{robot.pid}/task/{robot.pid}/children").read_text().split()
        assert shown(robot.pid) == "control"
        assert sorted(shown(int(child)) for child in children) == ["estimator", "gateway"]
        robot.terminate()
        assert robot.wait(60.0) == 0
