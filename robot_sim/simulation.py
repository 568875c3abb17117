"""The simulation: owns the model, its state and the time; takes commands, gives readings and truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from localization.types import Pose, Reading, Twist, WheelSpeeds
from robot_sim.actors.mocap_driver import MocapDriver
from robot_sim.drive.aria_packets import StandardPacket
from robot_sim.drive.drivetrain import DriveConfig, Drivetrain
from robot_sim.drive.encoders import Encoders
from robot_sim.drive.motor_controller import Firmware, Override
from robot_sim.drive.robot_condition import Condition, ConditionMonitor
from robot_sim.drive.tyres import Tyres
from robot_sim.drive.wheel_slip import Slip, slip_of
from robot_sim.physics import Physics, TickMotion
from robot_sim.raycasting import caster_for
from robot_sim.robot.mujoco_body import SERVO_DAMPING, SERVO_STIFFNESS, WHEELS
from robot_sim.robot_placement import obstacles_touched
from robot_sim.sensors.imu import InertialConfig, InertialUnit
from robot_sim.sensors.lidar import Scanner, ScannerConfig, scans_until
from robot_sim.sensors.pose_history import PoseRecorder
from robot_sim.sensors.surface_optics import optics_of
from robot_sim.worlds.loading import load_world
from robot_sim.worlds.world import TIMESTEP_NS, World

TICK_NS: Final = 20_000_000
"""One tick [ns]: the period of wheel and inertial readings, and of commands."""
STEPS_PER_TICK: Final = TICK_NS // TIMESTEP_NS

_DT: Final = TIMESTEP_NS * 1e-9


@dataclass(frozen=True, slots=True)
class SimulationConfig:
    """Limits of the drive, and the sensors with their errors."""

    drive: DriveConfig = field(default_factory=DriveConfig)
    inertial: InertialConfig = field(default_factory=InertialConfig)
    scanners: tuple[ScannerConfig, ...] = (
        ScannerConfig("laser_horizontal"),
        ScannerConfig("laser_vertical"),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """Where the robot really is: for referees and tests, never for a localiser."""

    stamp: int
    map_from_base: Pose
    twist: Twist
    slip: Slip
    """How the wheels slip on the ground, and what the robot turns about."""


class Simulation:
    """A Pioneer 3-AT somewhere. One call of ``step`` is one tick of 20 ms; there is no other clock."""

    def __init__(
        self,
        scene: str | World,
        *,
        seed: int = 0,
        config: SimulationConfig | None = None,
        start: Pose | None = None,
    ) -> None:
        """Put the robot into a scene.

        Args:
            scene: Name of a scene, or a world.
            seed: Of all noise and biases; same seed and commands, same readings, bit by bit.
            config: Limits and sensors.
            start: ``map_from_base`` to start from at rest, instead of the world's spawn.
        """
        self.world = load_world(scene) if isinstance(scene, str) else scene
        self.config = config if config is not None else SimulationConfig()
        self._robot = self.world.robot
        mounts = self._robot.mounts
        self.mounts: Mapping[str, Pose] = {s.name: mounts[s.name] for s in self.config.scanners}
        start = start if start is not None else self.world.spawn
        self._physics = Physics(self.world.model, start, steps_per_tick=STEPS_PER_TICK)
        self._model, self._data = self._physics.model, self._physics.data
        self._tyres = Tyres(self._model, self._robot, self.world.patches)
        self._mocap_driver = MocapDriver(self._model, self.world.movers, TICK_NS)
        self._index_joints()

        # Children are numbered: wheels 0, inertial unit 1, then the scanners as they are mounted.
        # A sensor more or less leaves the noise of the others as it is.
        seeds = np.random.SeedSequence(seed).spawn(2 + len(mounts))
        self._drive = Drivetrain(self.config.drive, self._robot)
        self._encoders = Encoders(self.config.drive, self._robot, seeds[0])
        firmware = self.config.drive.firmware
        self._firmware = None if firmware is None else Firmware(firmware)
        self._monitor = ConditionMonitor(
            self._model, self._data, self._robot, tick=TICK_NS, stall=self.config.drive.stall
        )
        self._condition = self._monitor.begin(self._data)
        self._inertial = InertialUnit(self.config.inertial, seeds[1])
        self._caster = caster_for(self.world, self._data)
        by_name = dict(zip(mounts, seeds[2:], strict=True))
        optical = any(s.effects.optical for s in self.config.scanners)
        optics = optics_of(self._model, self._data) if optical else None
        self._scanners = [
            Scanner(s, mounts[s.name], self._caster, by_name[s.name], optics)
            for s in self.config.scanners
        ]
        self._pose_recorder = PoseRecorder(0, self._data.qpos[self._base])

    def _index_joints(self) -> None:
        """Keep views of the wheels' numbers; MuJoCo lays out joints and motors in our order."""
        model, data = self._model, self._data
        first, last = WHEELS[0], WHEELS[-1]
        q = slice(model.joint(first).qposadr[0], model.joint(last).qposadr[0] + 1)
        v = slice(model.joint(first).dofadr[0], model.joint(last).dofadr[0] + 1)
        act = slice(model.actuator(first).actadr[0], model.actuator(last).actadr[0] + 1)
        self._wheel_angles, self._wheel_rates = data.qpos[q], data.qvel[v]
        self._wheel_targets = data.act[act]
        base = model.joint("base_link")
        self._base = slice(base.qposadr[0], base.qposadr[0] + 7)
        self._base_rates = slice(base.dofadr[0], base.dofadr[0] + 6)
        accelerometer = model.sensor("accelerometer").adr[0]
        self._accelerometer = slice(accelerometer, accelerometer + 3)

    @property
    def stamp(self) -> int:
        """Time since the start [ns]: whole steps, for a sum of floating steps drifts."""
        return self._physics.stamp

    @property
    def touching(self) -> tuple[str, ...]:
        """Names of the obstacles that the robot's hull touches now."""
        return obstacles_touched(self._model, self._data)

    @property
    def condition(self) -> Condition:
        """How the robot fared in the last tick: bumpers, tilt, stalls."""
        return self._condition

    @property
    def packet(self) -> StandardPacket | None:
        """What the controller sent at the end of the last tick, if it has firmware and one was due."""
        return None if self._firmware is None else self._firmware.packet

    def command(self, twist: Twist) -> None:
        """Set the twist the drive goes for, within its limits and ramps, until the next command."""
        self._drive.command(twist)

    def step(self) -> tuple[Reading, ...]:
        """Advance one tick and return the readings that came due, in the order in which they end.

        Raises:
            PhysicsError: the physics became unstable.
        """
        motion = self._advance()
        self._pose_recorder.extend(motion.stamps, motion.poses)
        stamp, dt = self.stamp, TICK_NS * 1e-9
        angles = 0.5 * (self._wheel_angles[:2] + self._wheel_angles[2:])
        speeds = self._encoders.read(stamp, angles, dt)
        self._condition = self._monitor.update(self._data, motion)
        wheels = self._through_firmware(speeds, dt)
        velocity = np.add.reduce(motion.angular_velocities) / STEPS_PER_TICK
        force = np.add.reduce(motion.sensors[:, self._accelerometer]) / STEPS_PER_TICK
        inertial = self._inertial.read(stamp, velocity, force)
        track = self._pose_recorder.track()
        scans = scans_until(stamp, self._scanners, self._caster, track)
        self._pose_recorder.forget(min([s.start for s in self._scanners], default=stamp))
        # Scans end before or with the tick.
        return (*scans, *wheels, inertial)

    def _through_firmware(self, speeds: WheelSpeeds, dt: float) -> tuple[WheelSpeeds, ...]:
        """Return the wheel speeds as the rest gets them, and let a controller stop the drive."""
        if self._firmware is None:
            return (speeds,)
        forward, _ = self._drive.target
        self._drive.override = self._firmware.judge(self._condition, forward)
        if self._drive.override is Override.RELAX:
            self._monitor.stall_detector.clear()
        told = self._firmware.take(speeds, dt)
        return () if told is None else (told,)

    def truth(self) -> Truth:
        """Return where ``base_link`` is, its velocity in ``base_link``, and how its wheels slip."""
        pose, rates = self._data.qpos[self._base], self._data.qvel[self._base_rates]
        map_from_base = Pose(pose[:3], pose[3:])
        linear = map_from_base.rotation.T @ rates[:3]
        slip = slip_of(self._robot, linear[0], linear[1], rates[5], self._wheel_rates)
        return Truth(self.stamp, map_from_base, Twist(linear, rates[3:]), slip)

    def _advance(self) -> TickMotion:
        """Run the physics of one tick.

        What must be written before it (poses of moved bodies, friction under the wheels) is
        written here: it holds from the tick's first step to its last.
        """
        self._mocap_driver.place(self._data, self.stamp + TICK_NS)
        self._tyres.grip(self._data)
        if self._robot.imperfections.integral_control:
            self._limit_windup()
        rates = self._drive.advance_tick(STEPS_PER_TICK, _DT)
        # Left and right rate to the front and to the rear wheels, in the order of WHEELS.
        return self._physics.advance(np.concatenate((rates, rates), axis=1))

    def _limit_windup(self) -> None:
        """Hold each servo's set-point where it asks for no more than the torque limit.

        Without this a blocked wheel gathers angle to catch up, and turns on after a stop. Once a
        tick is enough: in 20 ms a set-point gets 0.15 rad ahead, and the torque is limited anyway.
        """
        settled = self._wheel_angles + (SERVO_DAMPING / SERVO_STIFFNESS) * self._wheel_rates
        relaxed = self._drive.override is Override.RELAX
        reach = 0.0 if relaxed else self._robot.wheel_torque / SERVO_STIFFNESS
        targets = self._wheel_targets
        np.maximum(targets, settled - reach, out=targets)
        np.minimum(targets, settled + reach, out=targets)
