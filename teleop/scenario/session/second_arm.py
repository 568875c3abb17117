"""A second arm of servos beside the robot: a board that follows over a line which can be unplugged, in the robot's time.

What sends its angles back to the robot stands beside the robot, as ``farsteer servo-bridge`` does.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from localization.types import SECOND
from robot_sim import TICK_NS
from robot_sim.arm.arm_table import ArmTable
from robot_sim.arm.servo_board import ServoBoard
from teleop.bridges.servos.bridge import ARRAY, MIRROR_DEGREES
from teleop.bridges.servos.servo_lines import Angles, LineReader, joint_line
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.faults import BoardUnplugged
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.operators.wire import Wire

_PARTS: Final = 10
"""Parts of a tick in which the board and its line go on."""
_REST: Final = SECOND
"""Time after which both arms are at rest [ns]."""
_GRIPPER: Final = 180.0
"""Angle of the gripper's servo where the jaws are widest apart [degrees]."""


class SecondArm:
    """Owns the board, its line, and what was seen of both arms."""

    def __init__(self, scenario: Scenario, table: ArmTable) -> None:
        """Switch the board of a scenario on."""
        resolution = scenario.world.board
        assert resolution is not None
        self._board, self._reader = ServoBoard(table, resolution), LineReader()
        faults = [fault for fault in scenario.fault if isinstance(fault, BoardUnplugged)]
        self._cuts = [(f.at, math.inf if f.lasting is None else f.at + f.lasting) for f in faults]
        self.cut_since: int | None = None
        """When its line was unplugged last [ns]; None if it is plugged in."""
        self.plugged_since = 0
        """When it was plugged in last [ns]."""
        self.said = ""
        """State that the robot published last, such as ``lost``."""
        self.error = math.nan
        """Largest error of a joint while both arms were at rest [rad]."""
        self._still = 0
        self._wire: Wire | None = None

    def join(self, wire: Wire) -> None:
        """Send its angles to the robot from now on, and see what that publishes of them."""
        self._wire = wire
        wire.subscribe("/arm/mirror", "farsteer_msgs/msg/ArmMirror", self._see)

    def _see(self, message: dict[str, Any]) -> None:
        self.said = str(message["state"])

    def take(self, tick: TickRecord) -> None:
        """Follow where the robot's arm is wanted, for a tick."""
        arm = tick.drive.arm
        assert arm is not None
        assert tick.truth.arm is not None
        if self._wire is not None:
            self._wire.deliver()
        cut = any(begin <= tick.stamp / SECOND < end for begin, end in self._cuts)
        if cut and self.cut_since is None:
            self.cut_since = tick.stamp
        elif not cut and self.cut_since is not None:
            self.cut_since, self.plugged_since = None, tick.stamp
        if not cut:
            wanted = [*np.degrees(arm.wanted).tolist(), _GRIPPER * arm.wanted_share]
            self._board.take(joint_line(wanted))
        self._still = 0 if arm.moving or cut else self._still + TICK_NS
        for _ in range(_PARTS):
            answers = self._reader.take(self._board.advance(TICK_NS // _PARTS))
            if not cut and self._wire is not None:
                for answer in answers:
                    if isinstance(answer, Angles):
                        self._wire.publish(MIRROR_DEGREES, ARRAY, {"data": list(answer.degrees)})
        if self._still >= _REST and not tick.truth.arm.touching:
            error = float(np.abs(self._board.angles - arm.angles).max())
            self.error = error if math.isnan(self.error) else max(self.error, error)
