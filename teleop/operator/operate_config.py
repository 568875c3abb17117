"""Settings of ``farsteer operate``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from teleop.errors import SettingError


@dataclass(frozen=True, slots=True)
class OperateConfig:
    """Which robot is operated, and how; each setting is an option of the command."""

    url: Annotated[str, tyro.conf.Positional] = "ws://127.0.0.1:9090"
    """Address of the robot."""
    map: Path | None = None
    """A copy of the robot's map, used if its hash is right; otherwise the robot's own is fetched and kept."""
    places: Path | None = None
    """Named places for hints (TOML, as in a scene's world.toml); those that the robot names by default."""
    record: Path | None = None
    """Record the display to this file (.rrd)."""
    viewer: bool = True
    """Open rerun's viewer; needs a screen."""
    camera: bool = False
    """Show the robot's camera, if it has one, ten times a second; depth twice."""
    path_ahead: Literal["late", "always", "never"] = "late"
    """Show where the robot will go: while the round trip is over 0.2 s, always, or never."""
    hint: tuple[float, float, float] | None = None
    """Send the robot a pose hint: x, y [m], heading [degrees]."""
    find: bool = False
    """Have the robot search the whole map for its pose; it then has to be driven a little."""
    duration: float | None = None
    """End after this time [s]."""
    token: Path | None = None
    """File with the token to send, on a line of its own."""
    ca: Path | None = None
    """Certificate to trust at a wss:// address, if this machine does not trust it already (PEM)."""

    def __post_init__(self) -> None:
        if self.find and self.hint is not None:
            raise SettingError(
                "--hint searches near a pose and --find the whole map: give one of them"
            )
        if self.duration is not None and not self.duration > 0.0:
            raise SettingError(f"duration must be > 0 s, got {self.duration}")
