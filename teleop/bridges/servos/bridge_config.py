"""Settings of ``farsteer servo-bridge``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from teleop.errors import SettingError


@dataclass(frozen=True, slots=True)
class ServoBridgeConfig:
    """Robot and board; each field is an option of the command."""

    robot: Annotated[str, tyro.conf.Positional] = "ws://127.0.0.1:9090"
    """Address of the robot."""
    port: Path = Path("/dev/ttyUSB0")
    """Serial port of the board; one of /dev/serial/by-id stays the same when it is plugged in again."""
    baud: int = 115_200
    """Bits per second of the port."""
    token_file: Path | None = None
    """File with the token to send to the robot."""
    ca: Path | None = None
    """Certificate to trust at a wss:// robot, if this machine does not trust it already (PEM)."""

    def __post_init__(self) -> None:
        if self.baud <= 0:
            raise SettingError(f"baud must be > 0, got {self.baud}; the sketch has 115200")
