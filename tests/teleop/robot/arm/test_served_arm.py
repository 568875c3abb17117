"""An arm in real time, whose parts are in three processes; in its log; and a robot without one."""

from __future__ import annotations

import asyncio
import itertools
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
from mcap.reader import make_reader

from localization.logs.open_log import open_log
from localization.maps.cloud import Cloud
from localization.types import Pose, WheelSpeeds
from robot_sim import SimulationConfig
from robot_sim.worlds.world import World
from teleop.robot.arm.arm_commands import Alive, Hand, Move
from teleop.robot.arm.arm_state import ArmState
from teleop.robot.assembly import RobotParts, build_drive
from teleop.robot.inbox import ArmWish, InboxMessage
from teleop.robot.serving.robot_options import RobotOptions
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.topics.arm_topics import ARM_ACTIONS, ARM_INPUTS, ARM_OUTPUTS, ARM_SERVICES
from teleop.scenario.session.inbox_file import InboxWriter, read_inboxes
from tests.teleop.robot.arm.support import arm_of
from tests.teleop.support import PATIENCE, Robots, in_a_loop, peer, real_time

JOG = {"joint_names": ["arm_joint_1"], "velocities": [0.4]}


@pytest.mark.process
@pytest.mark.slow
@pytest.mark.long
@in_a_loop
async def test_arm_moves_and_is_held_in_real_time_and_is_in_the_log(
    room_with_arm: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    log = tmp_path / "drive.mcap"
    config = ServeConfig(port=0, record=log, robot=RobotOptions(arm="s2"))
    async with (
        real_time(room_with_arm, office_cloud, cache, config) as server,
        peer(server.url) as client,
    ):
        await client.subscribe("/arm/state", "/arm/info", "/tf_static")
        await client.until(lambda: client.messages("/arm/state"), "a state")

        def turned() -> bool:
            return bool(client.last("/arm/state")["wanted"][0] > 0.05)

        async with asyncio.timeout(PATIENCE):
            for number in itertools.count():
                # A stream that has fallen silent, as on a busy machine, owes a zero first.
                rate = 0.0 if number % 25 == 24 else 0.4
                jog = {**JOG, "velocities": [rate]}
                await client.publish("/servo_node/delta_joint_cmds", jog)
                await asyncio.sleep(0.02)
                if turned():
                    break
        await client.until(lambda: client.last("/arm/state")["mode"] == "held", "the watchdog")
        frames = [t["child_frame_id"] for t in client.last("/tf_static")["transforms"]]
        assert "arm_base" in frames
        good, values = await client.ask("/arm/stow")
        assert (good, values["success"]) == (True, True)

    with log.open("rb") as file:
        topics = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert "/arm/joint_states" in topics
    readings = list(open_log(log))
    assert any(isinstance(reading, WheelSpeeds) for reading in readings), "as without an arm"


@pytest.mark.slow
@in_a_loop
async def test_robot_without_an_arm_has_none_of_its_interfaces(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        _, topics = await client.ask("/rosapi/topics")
        _, services = await client.ask("/rosapi/services")
        _, actions = await client.ask("/rosapi/action_servers")
        names = {*topics["topics"], *services["services"], *actions["action_servers"]}
        own = {row.name for rows in (ARM_INPUTS, ARM_ACTIONS, ARM_SERVICES) for row in rows}
        own |= {topic.name for topic in ARM_OUTPUTS}
        assert names & own == set()
        await client.publish("/servo_node/delta_joint_cmds", JOG)
        assert "not yet advertised" in (await client.settle())[0]["msg"]
        await client.subscribe("/joint_states", "/robot_description")
        await client.step()
        assert client.last("/joint_states")["name"] == ["left_wheels", "right_wheels"]
        assert "arm_base" not in client.last("/robot_description")["data"]


_WITHOUT = """
import sys
from robot_sim.worlds.loading import parse_world
from teleop.robot.assembly import RobotParts, build_drive
from tests.robot_sim.conftest import ROOM
from robot_sim import SimulationConfig

drive = build_drive(RobotParts(parse_world(ROOM, name="room"), simulation=SimulationConfig(scanners=())))
record = drive.tick(0, [])
assert record.arm is None
import teleop.robot.serve, teleop.robot.real_time.gateway_process
of_the_arm = ("daqp", "ruckig", "teleop.robot.arm.arm_control")
of_the_camera = ("OpenGL", "robot_sim.cameras.renderer", "teleop.pictures", "teleop.robot.cameras.")
loaded = [name for name in sys.modules if name.startswith(of_the_arm + of_the_camera)]
print(loaded)
"""


@pytest.mark.process
def test_robot_without_arm_and_camera_imports_nothing_of_them() -> None:
    done = subprocess.run(
        [sys.executable, "-c", _WITHOUT], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[]"


def test_same_wishes_from_their_file_give_the_same_bits(
    room_with_arm: World, tmp_path: Path
) -> None:
    def drive(inboxes: Mapping[int, Sequence[InboxMessage]], file: Path) -> list[ArmState]:
        made = build_drive(RobotParts(room_with_arm, simulation=SimulationConfig(scanners=())))
        writer = InboxWriter(file)
        states = []
        for tick in range(150):
            stamp = made.simulation.stamp
            messages = inboxes.get(tick, ())
            writer.write(tick, messages)
            states.append(arm_of(made.tick(stamp, messages)))
        writer.close()
        return states

    alive = [ArmWish("ann", Alive())]
    wanted: dict[int, list[InboxMessage]] = {tick: [*alive] for tick in range(150)}
    wanted[5] = [ArmWish("ann", Move(1, pose=Pose.from_euler((0.3, 0.1, 0.1))))]
    for tick in range(90, 110):
        hand = Hand(Pose.from_euler((0.0, 0.001 * tick, 0.0)), engaged=tick > 91)
        wanted[tick] = [ArmWish("ann", hand)]
    first = drive(wanted, tmp_path / "first")
    again = drive(read_inboxes(tmp_path / "first"), tmp_path / "again")
    for one, other in zip(first, again, strict=True):
        assert one.wanted.tobytes() == other.wanted.tobytes()
        assert one.angles.tobytes() == other.angles.tobytes()
        assert (one.mode, one.reason) == (other.mode, other.reason)
    assert {state.mode for state in first} >= {"plan", "hand"}
