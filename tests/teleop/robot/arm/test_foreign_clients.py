"""A program that imports nothing of ours drives each interface of the arm."""

from __future__ import annotations

import asyncio
import json
import shutil
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

PROGRAM = Path(__file__).parent / "programs" / "arm_with_roslib.mjs"
INTERFACES = {
    *(topic.name for topic in ARM_OUTPUTS),
    *(row.name for row in (ARM_INFO, *ARM_INPUTS, *ARM_ACTIONS, *ARM_SERVICES)),
}


@pytest.mark.process
@pytest.mark.slow
@pytest.mark.long
@pytest.mark.skipif(shutil.which("npm") is None, reason="Node is not installed")
@in_a_loop
async def test_roslib_drives_each_interface_of_the_arm(
    room_with_arm: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    program = shutil.copy(PROGRAM, installed(tmp_path, *ROSLIB))
    async with lockstep(room_with_arm, office_cloud, cache) as rig:
        process = await asyncio.create_subprocess_exec(
            *("node", program, str(rig.server.port)), stdout=PIPE, stderr=PIPE
        )
        out, err = await process.communicate()
    assert process.returncode == 0, err.decode()
    found = dict(json.loads(line) for line in out.decode().splitlines())
    assert {name: why for name, why in found.items() if why} == {}
    assert found.keys() >= INTERFACES, "an interface that nobody has tried"
