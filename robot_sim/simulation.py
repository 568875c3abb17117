"""The simulation: owns the model, its state and the time; takes commands, gives readings and truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import mujoco
import numpy as np

from localization.types import Pose, Reading, Scan, Twist
from robot_sim.arrays import FloatArray
from robot_sim.drive import Drive, DriveConfig, Encoders
from robot_sim.errors import PhysicsError
from robot_sim.inertial import InertialConfig, InertialUnit
from robot_sim.lidar import MujocoRayCaster, Scanner, ScannerConfig, Track
from robot_sim.p3at import MOUNTS, P3AT, SERVO_DAMPING, SERVO_STIFFNESS, WHEELS
from robot_sim.worlds import TIMESTEP_NS, World, load_world, obstacles_touched, place_robot

STEPS_PER_TICK: Final = 10
TICK_NS: Final = STEPS_PER_TICK * TIMESTEP_NS
"""One tick [ns]: the period of wheel and inertial readings, and of commands."""

_DT: Final = TIMESTEP_NS * 1e-9
_FATAL: Final = {
    mujoco.mjtWarning.mjWARN_BADQPOS: "a position is not finite or too large",
    mujoco.mjtWarning.mjWARN_BADQVEL: "a velocity is not finite or too large",
    mujoco.mjtWarning.mjWARN_BADQACC: "an acceleration is not finite or too large",
    mujoco.mjtWarning.mjWARN_BADCTRL: "a wheel command is not finite",
}


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
        self.mounts: Mapping[str, Pose] = {s.name: MOUNTS[s.name] for s in self.config.scanners}
        self._robot = P3AT()
        self._model = self.world.model
        self._data = mujoco.MjData(self._model)
        place_robot(self._model, self._data, start if start is not None else self.world.spawn)
        self._steps = 0
        self._index_joints()

        # Children are numbered: wheels 0, inertial unit 1, then the scanners as they are mounted.
        # A sensor more or less leaves the noise of the others as it is.
        seeds = np.random.SeedSequence(seed).spawn(2 + len(MOUNTS))
        self._drive = Drive(self.config.drive, self._robot)
        self._encoders = Encoders(self.config.drive, self._robot, seeds[0])
        self._inertial = InertialUnit(self.config.inertial, seeds[1])
        caster = MujocoRayCaster(self._model, self._data)
        by_name = dict(zip(MOUNTS, seeds[2:], strict=True))
        self._scanners = [
            Scanner(s, MOUNTS[s.name], caster, by_name[s.name]) for s in self.config.scanners
        ]
        self._stamps: list[int] = [0]
        self._poses: list[FloatArray] = [self._pose.copy()]

    def _index_joints(self) -> None:
        """Keep views of the wheels' numbers; MuJoCo lays out joints and motors in our order."""
        model, data = self._model, self._data
        first, last = WHEELS[0], WHEELS[-1]
        q = slice(model.joint(first).qposadr[0], model.joint(last).qposadr[0] + 1)
        v = slice(model.joint(first).dofadr[0], model.joint(last).dofadr[0] + 1)
        act = slice(model.actuator(first).actadr[0], model.actuator(last).actadr[0] + 1)
        self._wheel_angles, self._wheel_rates = data.qpos[q], data.qvel[v]
        self._wheel_targets, self._wheel_commands = data.act[act], data.ctrl
        self._pose = data.qpos[:7]
        self._angular_velocity = data.qvel[3:6]

    @property
    def stamp(self) -> int:
        """Time since the start [ns]: whole steps, for a sum of floating steps drifts."""
        return self._steps * TIMESTEP_NS

    @property
    def touching(self) -> tuple[str, ...]:
        """Names of the obstacles that the robot's hull touches now."""
        return obstacles_touched(self._model, self._data)

    def command(self, twist: Twist) -> None:
        """Set the twist the drive goes for, within its limits and ramps, until the next command."""
        self._drive.command(twist)

    def step(self) -> tuple[Reading, ...]:
        """Advance one tick and return the readings that came due, in the order in which they end.

        Raises:
            PhysicsError: the physics became unstable.
        """
        self._check()
        velocity, force = self._advance()
        self._check()
        stamp, dt = self.stamp, TICK_NS * 1e-9
        angles = self._wheel_angles.reshape(2, 2).mean(axis=0)
        wheels = self._encoders.read(stamp, angles, dt)
        inertial = self._inertial.read(stamp, velocity, force)
        scans: list[Scan] = [s.sweep(self._track()) for s in self._scanners if s.end <= stamp]
        self._forget()
        # Scans end before or with the tick; sorting is stable, so wheels stay before the inertial unit.
        scans.sort(key=lambda scan: scan.end_stamp)
        return (*scans, wheels, inertial)

    def truth(self) -> Truth:
        """Return where ``base_link`` is, and its velocity in ``base_link``."""
        pose = Pose(self._data.qpos[:3], self._data.qpos[3:7])
        linear = pose.rotation.T @ self._data.qvel[:3]
        return Truth(self.stamp, pose, Twist(linear, self._data.qvel[3:6]))

    def _advance(self) -> tuple[FloatArray, FloatArray]:
        """Run the physics of one tick; return mean angular velocity and specific force in base_link."""
        data = self._data
        velocity, force = np.zeros(3), np.zeros(3)
        for _ in range(STEPS_PER_TICK):
            left, right = self._drive.advance(_DT)
            self._wheel_commands[:] = (left, right, left, right)
            self._limit_windup()
            mujoco.mj_step(self._model, data)
            self._steps += 1
            # Velocities after a step are those that moved the robot in it; forces are of its start.
            velocity += self._angular_velocity
            force += data.sensordata[:3]
            self._stamps.append(self.stamp)
            self._poses.append(self._pose.copy())
        return velocity / STEPS_PER_TICK, force / STEPS_PER_TICK

    def _limit_windup(self) -> None:
        """Hold each servo's set-point where it asks for no more than the torque limit.

        Without this a blocked wheel gathers angle to catch up, and turns on after a stop.
        """
        settled = self._wheel_angles + (SERVO_DAMPING / SERVO_STIFFNESS) * self._wheel_rates
        reach = self._robot.wheel_torque / SERVO_STIFFNESS
        targets = self._wheel_targets
        np.maximum(targets, settled - reach, out=targets)
        np.minimum(targets, settled + reach, out=targets)

    def _track(self) -> Track:
        poses = np.array(self._poses)
        return Track(np.array(self._stamps, dtype=np.int64), poses[:, :3], poses[:, 3:])

    def _forget(self) -> None:
        """Drop the poses that no coming sweep can ask for."""
        oldest = min([s.start for s in self._scanners], default=self.stamp)
        keep = max(0, (min(oldest, self.stamp) - self._stamps[0]) // TIMESTEP_NS)
        del self._stamps[:keep], self._poses[:keep]

    def _check(self) -> None:
        data = self._data
        reason = next(
            (text for kind, text in _FATAL.items() if data.warning[kind].number > 0), None
        )
        if reason is None and not np.isfinite(data.qpos).all():
            reason = _FATAL[mujoco.mjtWarning.mjWARN_BADQPOS]
        if reason is None and not np.isfinite(data.qvel).all():
            reason = _FATAL[mujoco.mjtWarning.mjWARN_BADQVEL]
        if reason is not None:
            raise PhysicsError(f"physics became unstable at {self.stamp * 1e-9:.3f} s: {reason}")


def _keep_quiet(message: str) -> None:
    """Take MuJoCo's warnings: ``data.warning`` counts them, and ``step`` raises what matters."""


# MuJoCo would otherwise write MUJOCO_LOG.TXT into whatever directory the process runs in.
mujoco.set_mju_user_warning(_keep_quiet)
