"""Programs that import nothing of ours drive each interface of the arm."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import sys
from asyncio.subprocess import PIPE
from pathlib import Path

import pytest

from localization.maps.cloud import Cloud
from robot_sim.worlds.world import World
from teleop.robot.topics.arm_topics import (
    ARM_ACTIONS,
    ARM_INFO,
    ARM_INPUTS,
    ARM_OUTPUTS,
    ARM_SERVICES,
)
from tests.teleop.rosbridge.foreign_clients.test_javascript_clients import ROSLIB, installed
from tests.teleop.support import in_a_loop, lockstep

PROGRAMS = Path(__file__).parent / "programs"
INTERFACES = {
    *(topic.name for topic in ARM_OUTPUTS),
    *(row.name for row in (ARM_INFO, *ARM_INPUTS, *ARM_ACTIONS, *ARM_SERVICES)),
}

pytestmark = [pytest.mark.process, pytest.mark.slow, pytest.mark.long]


@in_a_loop
async def drive_all(
    command: list[str], world: World, cloud: Cloud, cache: Path, found: dict[str, str | None]
) -> None:
    """Serve a robot with an arm to a program; note what the program says about each interface."""
    async with lockstep(world, cloud, cache) as rig:
        process = await asyncio.create_subprocess_exec(
            *command, str(rig.server.port), stdout=PIPE, stderr=PIPE, env={**os.environ}
        )
        out, err = await process.communicate()
    assert process.returncode == 0, err.decode()
    found.update(dict(json.loads(line) for line in out.decode().splitlines()))


def test_roslibpy_drives_each_interface_of_the_arm(
    room_with_arm: World, office_cloud: Cloud, cache: Path
) -> None:
    found: dict[str, str | None] = {}
    program = str(PROGRAMS / "arm_with_roslibpy.py")
    drive_all([sys.executable, program], room_with_arm, office_cloud, cache, found)
    assert {name: why for name, why in found.items() if why} == {}
    assert found.keys() >= INTERFACES, "an interface that nobody has tried"


@pytest.mark.skipif(shutil.which("npm") is None, reason="Node is not installed")
def test_roslib_drives_each_interface_of_the_arm(
    room_with_arm: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    found: dict[str, str | None] = {}
    program = shutil.copy(PROGRAMS / "arm_with_roslib.mjs", installed(tmp_path, *ROSLIB))
    drive_all(["node", str(program)], room_with_arm, office_cloud, cache, found)
    assert {name: why for name, why in found.items() if why} == {}
    assert found.keys() >= INTERFACES
