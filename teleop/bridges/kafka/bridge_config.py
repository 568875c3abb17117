"""Settings of ``farsteer kafka-bridge``."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from teleop.errors import SettingError
from teleop.step_commands.turtle_control import StepSizes


@dataclass(frozen=True, slots=True)
class BridgeConfig:
    """Robot, topics and rules of the bridge; each field is an option of the command."""

    robot: str = "ws://127.0.0.1:9090"
    """Address of the robot."""
    token_file: Path | None = None
    """File with the token to send to the robot, of role operate; never of an admin."""
    ca: Path | None = None
    """Certificate to trust at a wss:// robot, if this machine does not trust it already (PEM)."""
    commands: str = "turtle_control"
    """Topic from which commands are read."""
    results: str = "turtle_result"
    """Topic to which the answer to each command is published."""
    location: str = "turtle_location"
    """Topic to which the robot's position is published; empty for none."""
    cameras: str = "cam_sources"
    """Topic to which the robot's list of video streams is published; empty for none."""
    partition: int | None = None
    """Partition of the commands; needed where their topic has several."""
    key: str | None = None
    """Key of this robot's commands, where several robots share a topic; others are passed over."""
    journal: Path | None = None
    """File that says what is driven and answered; in the user's state folder by default. Keep it with the robot."""
    max_age: float = 5.0
    """Age from which a command is not obeyed any more [s]; 0 for no limit."""
    measure_by: Literal["odometry", "localization"] = "odometry"
    """What says how far a step went."""
    speed: float = 0.0
    """Speed of straight steps [m/s]; 0 for the robot's own."""
    turn_speed: float = 0.0
    """Speed of turns [deg/s]; 0 for the robot's own."""
    right_turns_left: bool = False
    """Whether right means left and left right, as in the program that these commands come from."""
    nested_json: bool = False
    """Whether the position is published as JSON text inside JSON, as by that program."""
    odometry_file: Path | None = None
    """File to which each published position is appended, with the time."""
    announce: float = 10.0
    """Time after which the list of video streams is published again [s]; 0 for only when it changes."""

    def __post_init__(self) -> None:
        for name in ("commands", "results", "location", "cameras"):
            topic = getattr(self, name)
            optional = name in ("location", "cameras")
            if not (optional and not topic) and not re.fullmatch(r"[A-Za-z0-9._-]{1,249}", topic):
                raise SettingError(
                    f"{name} must be a topic of letters, digits, dots, - and _, got {topic!r}"
                )
        if len({self.commands, self.results}) < 2:
            raise SettingError("results need a topic of their own, not that of the commands")
        if self.partition is not None and self.partition < 0:
            raise SettingError(f"partition must be 0 or more, got {self.partition}")
        for name in ("max_age", "speed", "turn_speed", "announce"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise SettingError(f"{name} must be 0 or more, got {value}")

    @property
    def sizes(self) -> StepSizes:
        """Speeds and senses of steps; their sizes are yet to be set by commands."""
        return StepSizes(
            speed=self.speed,
            turn_speed=math.radians(self.turn_speed),
            right_turns_left=self.right_turns_left,
        )
