"""Condition of the robot after a tick: bumpers, contacts, attitude, stalled motors, fallen or not."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco

from robot_sim.array_types import FloatArray
from robot_sim.drive.bumpers import Bumpers
from robot_sim.drive.contacts import ContactFinder, ContactSummary
from robot_sim.drive.motor_stall import StallConfig, StallDetector
from robot_sim.physics import TickMotion
from robot_sim.robot.mujoco_body import WHEELS
from robot_sim.robot.skid_steer_parameters import SkidSteer

FALLEN_TILT = math.radians(60.0)
"""Tilt beyond which the robot counts as fallen [rad]; it tips over its wheels' contacts at about 50
degrees sideways and 40 lengthways, and no drivable slope is as steep."""


@dataclass(frozen=True, slots=True)
class Condition:
    """Condition of the robot after one tick; contacts of any of its physics steps count."""

    stamp: int
    """End of the tick [ns]."""
    bumpers: Bumpers
    """Pressed segments of the bumper rings."""
    touching: tuple[str, ...]
    """Sorted names of the obstacles that the hull or the wheels' sides touched; known to a
    simulation only."""
    roll: float
    """Roll, positive with the left side up (REP 103) [rad]."""
    pitch: float
    """Pitch, positive with the nose down [rad]."""
    wheels_down: tuple[bool, bool, bool, bool]
    """Whether the front left, front right, rear left and rear right wheels are on the ground."""
    grounded: bool
    """Whether the hull rests on the ground."""
    left_stalled: bool
    """Whether the left motors are powered but turn barely or not at all."""
    right_stalled: bool
    """Whether the right motors are powered but turn barely or not at all."""
    fallen: bool
    """Whether the robot is tilted too far to stand."""

    @property
    def tilt(self) -> float:
        """Angle of the robot's up axis from the vertical [rad]."""
        return math.acos(max(-1.0, min(1.0, math.cos(self.roll) * math.cos(self.pitch))))

    @property
    def troubles(self) -> tuple[str, ...]:
        """Problems that the robot's own sensors can observe, the worst first."""
        stalled = {
            (True, True): "motors stalled",
            (True, False): "left motors stalled",
            (False, True): "right motors stalled",
        }
        texts = (
            "fallen" if self.fallen else "",
            stalled.get((self.left_stalled, self.right_stalled), ""),
            "bumped in front" if any(self.bumpers.front) else "",
            "bumped behind" if any(self.bumpers.rear) else "",
        )
        return tuple(text for text in texts if text)


class ConditionMonitor:
    """Computes the condition of one robot after every tick."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        robot: SkidSteer,
        *,
        tick: int,
        stall: StallConfig,
    ) -> None:
        """Begin at rest, after ``mj_forward``; ``tick`` is the time between updates [ns]."""
        self._finder = ContactFinder(model, data)
        self.stall_detector = StallDetector(robot, stall, tick)
        joints = [model.joint(wheel) for wheel in WHEELS]
        dofs = [int(joint.dofadr[0]) for joint in joints]
        self._rates = data.qvel[dofs[0] : dofs[-1] + 1]
        motors = [int(model.actuator(wheel).id) for wheel in WHEELS]
        self._torques = data.actuator_force[motors[0] : motors[-1] + 1]

    def update(self, data: mujoco.MjData, motion: TickMotion) -> Condition:
        """Return the condition after the tick that has just been rolled out into ``data``."""
        touches = self._finder.find(data, motion)
        stalled = self.stall_detector.update(self._torques, self._rates)
        return self._condition(int(motion.stamps[-1]), motion.poses[-1], touches, stalled)

    def begin(self, data: mujoco.MjData) -> Condition:
        """Return the condition before the first tick."""
        pose = data.joint("base_link").qpos
        return self._condition(0, pose, self._finder.begin(data), (False, False))

    def _condition(
        self, stamp: int, pose: FloatArray, touches: ContactSummary, stalled: tuple[bool, bool]
    ) -> Condition:
        left, right = stalled
        roll, pitch, upright = attitude(pose[3:])
        return Condition(
            stamp=stamp,
            bumpers=touches.bumpers,
            touching=touches.names,
            roll=roll,
            pitch=pitch,
            wheels_down=touches.wheels_down,
            grounded=touches.grounded,
            left_stalled=left,
            right_stalled=right,
            fallen=upright < math.cos(FALLEN_TILT),
        )


def attitude(quaternion_wxyz: FloatArray) -> tuple[float, float, float]:
    """Return roll and pitch [rad] and the cosine of the tilt of a unit quaternion (4,)."""
    w, x, y, z = quaternion_wxyz.tolist()
    ahead, aside, up = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
    return math.atan2(aside, up), math.asin(max(-1.0, min(1.0, -ahead))), up
