"""Ticks made by hand, of a robot that does whatever a test says."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from localization.types import Estimate, Health, HintVerdict, Pose, Twist
from robot_sim import P3AT, TICK_NS
from robot_sim.drive.bumpers import Bumpers
from robot_sim.drive.robot_condition import Condition
from robot_sim.drive.wheel_slip import slip_of
from robot_sim.simulation import Truth
from teleop.joystick import VelocityRequest
from teleop.robot.inbox import DriveCommand, InboxMessage
from teleop.robot.safety.control_state import ControlMode, ControlState
from teleop.robot.tick_record import DriveRecord, EstimateRecord, TickRecord

ROBOT = P3AT()
COVARIANCE = np.diag([0.01, 0.01, 0.01, 1e-4, 1e-4, 1e-4])


class Ticks:
    """Makes ticks one after the other; what is not said stays as it was."""

    def __init__(self) -> None:
        self.number = 0

    def tick(
        self,
        x: float = 0.0,
        y: float = 0.0,
        heading: float = 0.0,
        *,
        speed: float = 0.0,
        turning: float = 0.0,
        guess: tuple[float, float, float] | Pose | None = None,
        known: bool = True,
        covariance: npt.NDArray[np.float64] = COVARIANCE,
        health: Health = Health.TRACKING,
        reasons: tuple[str, ...] = (),
        verdict: HintVerdict | None = None,
        command: float = 0.0,
        mode: ControlMode = ControlMode.IDLE,
        driver: str = "",
        age: int = 0,
        reason: str = "driving",
        touching: Iterable[str] = (),
        tilt: float = 0.0,
        height: float = 0.0,
        inbox: Iterable[InboxMessage] = (),
    ) -> TickRecord:
        """Return the next tick.

        Args:
            x: True x at its end [m].
            y: True y [m].
            heading: True heading [rad].
            speed: True forward speed [m/s].
            turning: True turn rate [rad/s].
            guess: Estimated x, y and heading, or pose; the true one unless given.
            known: Whether there is an estimate.
            covariance: (6, 6) of the estimate.
            health: Of the estimate.
            reasons: Of the health.
            verdict: Answer to a hint.
            command: Forward speed in force [m/s].
            mode: Of the command path.
            driver: Name of the client that drives.
            age: Of its last command [ns].
            reason: Of the mode.
            touching: Names of touched obstacles.
            tilt: From the vertical [rad].
            height: True z [m].
            inbox: Messages of the tick.
        """
        self.number += 1
        stamp = self.number * TICK_NS
        flat = Pose.planar(x, y, heading)
        true = Pose(flat.position + (0.0, 0.0, height), flat.quaternion_wxyz)
        estimated = guess if isinstance(guess, Pose) else Pose.planar(*(guess or (x, y, heading)))
        estimate = Estimate(
            stamp,
            estimated if known else None,
            Pose.identity(),
            covariance,
            Twist.planar(0.0, 0.0),
            health,
            reasons,
            verdict=verdict,
        )
        drive = DriveRecord(
            stamp=stamp,
            robot=ROBOT,
            inbox=tuple(inbox),
            sensed=(),
            control=ControlState(mode, reason, driver, age, Twist.planar(command, 0.0)),
            rejections=(),
            truth=Truth(
                stamp,
                true,
                Twist.planar(speed, turning),
                slip_of(ROBOT, speed, 0.0, turning, np.zeros(4)),
            ),
            condition=Condition(
                stamp,
                Bumpers(),
                tuple(touching),
                tilt,
                0.0,
                (True, True, True, True),
                False,
                False,
                False,
                tilt > math.pi / 3,
            ),
            packet=None,
            attitude=None,
        )
        return TickRecord(drive, EstimateRecord(stamp, (estimate,)))


def drive_command(client: str, forward: float, *, age: int = 0) -> DriveCommand:
    """Return a command with the deadman held."""
    request = VelocityRequest(Twist.planar(forward, 0.0), enabled=True)
    return DriveCommand(client, request, age=age)
