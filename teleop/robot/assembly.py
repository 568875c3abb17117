"""The composition root: a robot is put together here, for real time, for lockstep and for scenarios.

In real time each process builds its part: ``build_drive`` control's, ``Gateway`` the gateway's. In lockstep
``build_stepped_robot`` joins the same parts in one thread.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from localization.extras import require
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import PreparedMap
from localization.pipeline.localizer import Localizer
from localization.types import Pose
from robot_sim import Simulation, SimulationConfig, World
from teleop.link.emulation import EmulatedLinks
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.drive import Drive, Stages
from teleop.robot.gateway import Gateway
from teleop.robot.guard.guard import Guard
from teleop.robot.robot import Robot
from teleop.robot.safety.control_state import SafetyConfig
from teleop.robot.safety.safety import Safety
from teleop.robot.safety.speed_limits import SpeedLimits
from teleop.robot.serving.camera_choice import stepped_camera, without_camera
from teleop.robot.serving.robot_options import slip_bursts
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.stepped_robot import SteppedRobot
from teleop.robot.topics.message_parts import Message
from teleop.robot.topics.topic_table import Interface, latched_messages
from teleop.rosbridge.auth.authenticator import Authenticator

if TYPE_CHECKING:  # imported only where there is an arm, or a camera
    from robot_sim.cameras import CameraModel
    from teleop.robot.arm_drive import ArmDrive


@dataclass(frozen=True, slots=True, eq=False)
class RobotParts:
    """What a robot is made of, but for its map and its server."""

    world: World
    """The scene."""
    seed: int = 0
    """Seed of the noise of its sensors."""
    simulation: SimulationConfig = field(default_factory=SimulationConfig)
    """Its drive and its sensors."""
    start: Pose | None = None
    """``map_from_base`` where it starts at rest; the world's spawn if None."""
    safety: SafetyConfig = field(default_factory=SafetyConfig)
    """Timeouts of the command path, and limits on old commands."""
    arm_speed: float = 0.2
    """Largest speed while an arm is off its stow pose [m/s]; 0 for no such limit."""
    guard: bool = True
    """Whether it has a guard; without scanners it has none."""

    @staticmethod
    def of(world: World, config: ServeConfig) -> RobotParts:
        """Return the parts of a robot that is served in a world."""
        settings = config.robot.simulation(slip_bursts(config.slip))
        safety = SafetyConfig(stale=config.stale_limits)
        speed = config.robot.arm_speed
        return RobotParts(
            world, config.seed, settings, arm_speed=speed, safety=safety, guard=config.guard
        )


def build_drive(parts: RobotParts, stage: Stages = lambda _: nullcontext()) -> Drive:
    """Return the drive, as control runs it; ``stage`` measures the stages of a tick."""
    simulation = Simulation(
        parts.world, seed=parts.seed, config=parts.simulation, start=parts.start
    )
    safety = Safety(SpeedLimits.of(simulation.config.drive), parts.safety)
    guard = None
    if parts.guard and simulation.mounts:
        guard = Guard(simulation.world.robot, simulation.mounts, simulation.config.drive)
    return Drive(simulation, safety, arm=_arm(parts, simulation, safety), guard=guard, stage=stage)


def build_stepped_robot(
    parts: RobotParts,
    cloud: Cloud,
    prepared: PreparedMap,
    config: ServeConfig,
    *,
    run_id: str = "",
    video: bool = True,
    authenticator: Authenticator | None = None,
    link: EmulatedLinks | None = None,
    hidden: Collection[str] = (),
    stage: Stages = lambda _: nullcontext(),
    without_camera: Callable[[Exception], None] = without_camera,
) -> SteppedRobot:
    """Return a robot and its server, in this thread; time passes when somebody ticks it.

    Args:
        parts: What it is made of.
        cloud: Its map.
        prepared: The same, prepared for the localiser.
        config: Settings of the server; ``lockstep`` says whether clients have unlimited time.
        run_id: Identity of this run of the robot, for its clients.
        video: See ``Gateway``, as for the three below.
        authenticator: Verifies tokens in the place of the file that the settings name.
        link: Emulates the links of clients in the place of that of the settings.
        hidden: Names of topics that are not published.
        stage: Measures the stages of a tick.
        without_camera: Called with the reason if nothing can be drawn; the robot then has no camera.

    Raises:
        ServerError: If tokens, certificate or origins are invalid.
        AuditError: If the audit log cannot be written.
        CameraError: If there is no camera of that name.
    """
    drive = build_drive(parts, stage)
    simulation = drive.simulation
    localizer = Localizer(prepared, simulation.mounts, stage=stage)
    robot = Robot(drive, localizer, stage=stage)
    stepped: SteppedRobot | None = None
    gateway = Gateway(
        config,
        lambda camera: latched_of(simulation, cloud, run_id, camera),
        lambda: 0 if stepped is None else stepped.stamp,
        undo_memory=localizer.config.undo_memory,
        scene=simulation.world.name,
        camera=lambda server: stepped_camera(
            simulation, config.camera, server, without=without_camera
        ),
        video=video,
        authenticator=authenticator,
        link=link,
        hidden=hidden,
        arm=ArmFit.of(parts.world),
    )
    stepped = SteppedRobot(robot, gateway)
    return stepped


def latched_of(
    simulation: Simulation, cloud: Cloud, run_id: str = "", camera: CameraModel | None = None
) -> Mapping[Interface, Message]:
    """Return what a robot publishes once: of its map, with an identity of this run and its camera."""
    world = simulation.world
    return latched_messages(
        cloud,
        world.robot,
        simulation.mounts,
        run_id,
        drive=simulation.config.drive,
        places=world.places,
        camera=camera,
        arm=ArmFit.of(world),
    )


def _arm(parts: RobotParts, simulation: Simulation, safety: Safety) -> ArmDrive | None:
    """Return what drives the arm, if there is one; imported here, since most robots have none."""
    if simulation.arm is None:
        return None
    require("daqp", "the arm")
    require("ruckig", "the arm")
    from teleop.robot.arm.arm_settings import ArmSettings
    from teleop.robot.arm_drive import ArmDrive

    settings = ArmSettings(parts.arm_speed, patience=safety.config.patience)
    return ArmDrive(simulation, safety, settings)
