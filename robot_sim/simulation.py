"""The simulation of one robot in a world: takes commands, returns sensor readings and ground truth."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import mujoco
import numpy as np

from localization.types import Pose, Reading, Twist, WheelSpeeds
from robot_sim.actors.mocap_driver import MocapDriver
from robot_sim.actors.movers import Mover
from robot_sim.actors.schedules import Arrival, Scheduled
from robot_sim.arm.arm_plant import ArmPlant, ArmReading
from robot_sim.arm.arm_touch import pickable_bodies
from robot_sim.cameras.visual_state import VisualState
from robot_sim.drive.aria_packets import StandardPacket
from robot_sim.drive.drivetrain import DriveConfig, Drivetrain, SlipFault
from robot_sim.drive.encoders import Encoders
from robot_sim.drive.motor_controller import Firmware, Override
from robot_sim.drive.robot_condition import Condition, ConditionMonitor
from robot_sim.drive.tyres import Tyres
from robot_sim.drive.wheel_slip import Slip, slip_of
from robot_sim.errors import SensorError
from robot_sim.physics import Physics, TickMotion
from robot_sim.raycasting import caster_for
from robot_sim.robot.mujoco_body import SERVO_DAMPING, SERVO_STIFFNESS, WHEELS
from robot_sim.robot_placement import carry_robot, obstacles_touched, refuse_contacts, robot_meets
from robot_sim.sensors.arm_shadow import ArmShadow
from robot_sim.sensors.imu import InertialConfig, InertialUnit
from robot_sim.sensors.lidar import Scanner, ScannerConfig, scans_until
from robot_sim.sensors.pose_history import PoseRecorder
from robot_sim.sensors.scanner_fault import ScannerFault, delivered
from robot_sim.sensors.surface_optics import optics_of
from robot_sim.worlds.loading import load_world
from robot_sim.worlds.spare_bodies import SpareBodies
from robot_sim.worlds.world import TIMESTEP_NS, World

TICK_NS: Final = 20_000_000
"""One tick [ns]: the period of wheel and inertial readings, and of commands."""
STEPS_PER_TICK: Final = TICK_NS // TIMESTEP_NS

_DT: Final = TIMESTEP_NS * 1e-9


@dataclass(frozen=True, slots=True)
class SimulationConfig:
    """Limits of the drivetrain, and the sensors with their errors."""

    drive: DriveConfig = field(default_factory=DriveConfig)
    """Limits of the motion, errors of the encoders and the motor controller."""
    inertial: InertialConfig = field(default_factory=InertialConfig)
    """Errors of the inertial unit."""
    scanners: tuple[ScannerConfig, ...] = (
        ScannerConfig("laser_horizontal"),
        ScannerConfig("laser_vertical"),
    )
    """The scanners, each mounted at the robot's mount of its name."""
    scanner_faults: tuple[ScannerFault, ...] = ()
    """Injected faults of these scanners."""

    def __post_init__(self) -> None:
        names = [scanner.name for scanner in self.scanners]
        for fault in self.scanner_faults:
            if fault.scanner not in names:
                raise SensorError(
                    f"no scanner {fault.scanner!r} to be faulty; there are:"
                    f" {', '.join(names) or 'none'}"
                )


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """Ground truth of the robot's motion: for evaluation and tests, never for a localiser."""

    stamp: int
    """Time since the start of the simulation [ns]."""
    map_from_base: Pose
    """True pose of ``base_link`` in ``map``."""
    twist: Twist
    """True velocity of ``base_link`` in its own axes [m/s, rad/s]."""
    slip: Slip
    """Slip of the wheels on the ground, and the robot's centres of rotation."""
    arm: ArmReading | None = None
    """The arm, with the names of what it touches; None without one."""
    parcels: tuple[tuple[str, Pose], ...] = ()
    """Name, and pose in ``map``, of each loose body that an arm can pick up; none without an arm."""


class Simulation:
    """A robot in a world. One call of ``step`` advances one tick of 20 ms; there is no other clock."""

    def __init__(
        self,
        scene: str | World,
        *,
        seed: int = 0,
        config: SimulationConfig | None = None,
        start: Pose | None = None,
    ) -> None:
        """Place the robot in a scene.

        Args:
            scene: Name of a scene, or a world.
            seed: Seed of all noise and biases; the same seed and commands give the same bits.
            config: Limits of the drivetrain and sensors; the defaults if not given.
            start: ``map_from_base`` where the robot starts at rest; the world's spawn if not given.
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
        self.spares = SpareBodies(self.world, lambda: self.stamp)
        """Bodies that can be put somewhere between two ticks."""
        world_movers = (m.own() if isinstance(m, Arrival) else m for m in self.world.movers)
        movers = (*world_movers, *self.spares.movers)
        self._waiting: tuple[str, ...] = ()
        self._arrivals = [mover for mover in movers if isinstance(mover, Arrival)]
        self._mocap_driver = MocapDriver(self._model, movers, TICK_NS)
        self.spares.on_change = self._show_spares
        self._refuse_extras_at_start(movers)
        self._index_joints()

        # Children are numbered: wheels 0, inertial unit 1, then the scanners as they are mounted.
        # Adding or removing a sensor does not change the noise of the others.
        seeds = np.random.SeedSequence(seed).spawn(2 + len(mounts))
        self._drive = Drivetrain(self.config.drive, self._robot)
        self._encoders = Encoders(self.config.drive, self._robot, seeds[0])
        firmware = self.config.drive.firmware
        self._firmware = None if firmware is None else Firmware(firmware)
        arm = self.world.arm
        self.arm = None if arm is None else ArmPlant(self._model, self._data, arm, tick=TICK_NS)
        """The arm, if the robot carries one."""
        self._parcels = () if arm is None else self._loose_bodies()
        self._monitor = ConditionMonitor(
            self._model, self._data, self._robot, tick=TICK_NS, stall=self.config.drive.stall
        )
        self._condition = self._monitor.begin(self._data)
        self._inertial = InertialUnit(self.config.inertial, seeds[1])
        self._caster = caster_for(replace(self.world, movers=movers), self._data)
        by_name = dict(zip(mounts, seeds[2:], strict=True))
        optical = any(s.effects.optical for s in self.config.scanners)
        optics = optics_of(self._model, self._data) if optical else None
        self._shadow = None if self.arm is None else ArmShadow(self._model, self._data, self.mounts)
        self._scanners = [
            Scanner(
                s,
                mounts[s.name],
                self._caster,
                by_name[s.name],
                optics,
                faults=[f for f in self.config.scanner_faults if f.scanner == s.name],
                shadow=self._shadow,
            )
            for s in self.config.scanners
        ]
        self._pose_recorder = PoseRecorder(0, self._data.qpos[self._base])

    def _loose_bodies(self) -> tuple[tuple[str, slice], ...]:
        """Return names of what an arm can pick up, and where their poses are among the positions."""
        model = self._model
        bodies = [model.body(int(b)) for b in np.flatnonzero(pickable_bodies(model))]
        starts = [(body.name, int(model.jnt_qposadr[body.jntadr[0]])) for body in bodies]
        return tuple((name, slice(start, start + 7)) for name, start in starts)

    def _refuse_extras_at_start(self, movers: Sequence[Mover]) -> None:
        """Raise a WorldError if the robot starts inside a body that is there from the beginning."""
        if any(isinstance(mover, Scheduled) for mover in movers):
            # In a copy: the physics' own state must be the same with and without bodies that come later.
            then = self._collided_at(0)
            self._mocap_driver.place(self._data, 0)
            refuse_contacts(self._model, then)

    def _collided_at(self, stamp: int) -> mujoco.MjData:
        """Return a copy of the present state with moving bodies where they are at ``stamp`` [ns], and contacts."""
        then = copy.copy(self._data)
        self._mocap_driver.place(then, stamp)
        mujoco.mj_kinematics(self._model, then)
        mujoco.mj_collision(self._model, then)
        return then

    def _hold_back_arrivals(self) -> None:
        """Let boxes and doors wait that would come upon the robot in this tick."""
        begin, end = self.stamp, self.stamp + TICK_NS
        coming = [arrival for arrival in self._arrivals if arrival.comes(begin, end)]
        if not coming:
            self._waiting = ()
            return
        then = self._collided_at(end)
        self._waiting = tuple(a.name for a in coming if robot_meets(self._model, then, a.name))
        for arrival in coming:
            if arrival.name in self._waiting:
                arrival.hold_back(end)
                self._mocap_driver.forget()

    def _show_spares(self) -> None:
        """Place the spare bodies anew, so that the robot is not carried into one that was just put down."""
        self._mocap_driver.forget()
        self._mocap_driver.place(self._data, self.stamp + 1)

    def _index_joints(self) -> None:
        """Keep views of the wheels' states; MuJoCo orders joints and motors as we do."""
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
        """Time since the start [ns]: an integer number of steps, so that it does not drift."""
        return self._physics.stamp

    @property
    def touching(self) -> tuple[str, ...]:
        """Names of the obstacles that the robot's hull touches now."""
        return obstacles_touched(self._model, self._data)

    @property
    def waiting(self) -> tuple[str, ...]:
        """Names of the boxes and doors that should have come by now, if the robot were not in their way."""
        return self._waiting

    @property
    def condition(self) -> Condition:
        """The robot's condition after the last tick: bumpers, tilt, stalls."""
        return self._condition

    @property
    def packet(self) -> StandardPacket | None:
        """The controller's packet of the last tick, if firmware is simulated and a packet was due."""
        return None if self._firmware is None else self._firmware.packet

    def command(self, twist: Twist) -> None:
        """Set the twist that the drivetrain aims for until the next command."""
        self._drive.command(twist)

    def step(self) -> tuple[Reading, ...]:
        """Advance one tick and return the readings that became due, in order of their end times.

        Raises:
            PhysicsError: the physics became unstable.
        """
        motion = self._advance()
        self._pose_recorder.extend(motion.stamps, motion.poses)
        if self.arm is not None:
            self.arm.read(self.stamp, motion.sensors, motion.positions)
        if self.arm is not None and self._shadow is not None:
            self._shadow.record(self.stamp, self.arm.reading.held)
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
        if self.config.scanner_faults:
            scans = delivered(scans, self.config.scanner_faults)
        oldest = min([s.start for s in self._scanners], default=stamp)
        self._pose_recorder.forget(oldest)
        if self._shadow is not None:
            self._shadow.forget(oldest)
        # Scans end before or with the tick.
        return (*scans, *wheels, inertial)

    def _through_firmware(self, speeds: WheelSpeeds, dt: float) -> tuple[WheelSpeeds, ...]:
        """Return the wheel speeds as the controller reports them, and apply its overrides."""
        if self._firmware is None:
            return (speeds,)
        forward, _ = self._drive.target
        self._drive.override = self._firmware.judge(self._condition, forward)
        if self._drive.override is Override.RELAX:
            self._monitor.stall_detector.clear()
        reported = self._firmware.take(speeds, dt)
        return () if reported is None else (reported,)

    def carry_to(self, map_from_base: Pose) -> None:
        """Set the robot down at rest elsewhere, as if somebody had carried it there between two ticks.

        Time, commands and noise go on; neither wheels nor gyro notice anything of it.

        Args:
            map_from_base: Where it stands then; its height and tilt should be those of a robot at rest there.

        Raises:
            WorldError: It would stand inside an obstacle; the message names it, and the robot stays where it was.
        """
        carry_robot(self._model, self._data, map_from_base)

    def slip(self, duration: int, factor: float) -> None:
        """Have the wheels spin from now on for a time [ns], as a ``SlipFault`` says."""
        still = [s for s in self._encoders.slips if s.start_ns + s.duration_ns > self.stamp]
        self._encoders.slips = [*still, SlipFault(self.stamp, duration, factor)]

    def truth(self) -> Truth:
        """Return the true pose and velocity of ``base_link``, and the slip of its wheels."""
        pose, rates = self._data.qpos[self._base], self._data.qvel[self._base_rates]
        map_from_base = Pose(pose[:3], pose[3:])
        linear = map_from_base.rotation.T @ rates[:3]
        slip = slip_of(self._robot, linear[0], linear[1], rates[5], self._wheel_rates)
        parcels = tuple(
            (name, Pose(self._data.qpos[at][:3], self._data.qpos[at][3:]))
            for name, at in self._parcels
        )
        arm = None if self.arm is None else self.arm.reading
        return Truth(self.stamp, map_from_base, Twist(linear, rates[3:]), slip, arm, parcels)

    def visual_state(self) -> VisualState:
        """Return what a picture of this instant depends on; see ``robot_sim.cameras``."""
        data = self._data
        return VisualState(
            self.stamp, data.qpos.copy(), data.mocap_pos.copy(), data.mocap_quat.copy()
        )

    def _advance(self) -> TickMotion:
        """Run the physics of one tick.

        Inputs that hold for the whole tick (poses of mocap bodies, friction under the wheels) are
        written first.
        """
        self._hold_back_arrivals()
        self._mocap_driver.place(self._data, self.stamp + TICK_NS)
        self._tyres.grip(self._data)
        if self._robot.imperfections.integral_control:
            self._limit_windup()
        if self.arm is not None:
            self.arm.drive()
        rates = self._drive.advance_tick(STEPS_PER_TICK, _DT)
        # Left and right rate to the front and to the rear wheels, in the order of WHEELS.
        return self._physics.advance(np.concatenate((rates, rates), axis=1))

    def _limit_windup(self) -> None:
        """Limit each servo's set-point to where it demands no more than the torque limit.

        Without this the integrator of a blocked wheel winds up, and the wheel keeps turning after a
        stop. Once a tick is enough: in 20 ms a set-point moves 0.15 rad, and torque is limited anyway.
        """
        settled = self._wheel_angles + (SERVO_DAMPING / SERVO_STIFFNESS) * self._wheel_rates
        relaxed = self._drive.override is Override.RELAX
        reach = 0.0 if relaxed else self._robot.wheel_torque / SERVO_STIFFNESS
        targets = self._wheel_targets
        np.maximum(targets, settled - reach, out=targets)
        np.minimum(targets, settled + reach, out=targets)
