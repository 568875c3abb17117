"""Settings of ``farsteer motion-platform`` and ``farsteer motion-receiver``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from teleop.errors import SettingError

Cueing = Literal["tilt", "washout"]


@dataclass(frozen=True, slots=True)
class MotionPlatformConfig:
    """Robot and motion base; each field is an option of the command."""

    robot: Annotated[str, tyro.conf.Positional] = "ws://127.0.0.1:9090"
    """Address of the robot."""
    platform: str = "simona"
    """Name of a platform, or the path of a .toml file like assets/platforms/simona.toml."""
    cueing: Cueing = "tilt"
    """Tilt as the robot tilts, or the classical washout of what it feels."""
    gain: float = 1.0
    """Share of tilts, or of accelerations and turns, that the platform shows."""
    udp: str | None = None
    """Where datagrams go, host:port; without it the poses are only published."""
    token_file: Path | None = None
    """File with the token to send to the robot."""
    ca: Path | None = None
    """Certificate to trust at a wss:// robot, if this machine does not trust it already (PEM)."""

    def __post_init__(self) -> None:
        if not 0.0 < self.gain <= 1.0:
            raise SettingError(f"gain must be > 0 and at most 1, got {self.gain}")
        if self.udp is not None:
            host_and_port(self.udp, "udp")


@dataclass(frozen=True, slots=True)
class MotionReceiverConfig:
    """What listens for datagrams; each field is an option of the command."""

    platform: str = "simona"
    """Name of a platform, or the path of a .toml file."""
    udp: str = "127.0.0.1:9095"
    """Where it listens, host:port."""

    def __post_init__(self) -> None:
        host_and_port(self.udp, "udp")


def host_and_port(text: str, name: str) -> tuple[str, int]:
    """Return the parts of ``host:port``.

    Raises:
        SettingError: If it is anything else.
    """
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise SettingError(f"{name} must be host:port with a port of 1 to 65535, got {text}")
    return host.removeprefix("[").removesuffix("]"), int(port)
