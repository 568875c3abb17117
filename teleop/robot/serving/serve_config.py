"""Settings of ``farsteer serve``."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import tyro

from teleop.errors import SettingError
from teleop.robot.safety.stale_commands import StaleLimits
from teleop.robot.serving.robot_options import RobotOptions, check_slip_times

if TYPE_CHECKING:
    from teleop.link.emulation import LinkConfig

LOOPBACK: Final = ("localhost", "127.0.0.1", "::1")
"""Addresses that only this machine can reach; not imported, for the socket's libraries take time."""


@dataclass(frozen=True, slots=True)
class ServeConfig:
    """How a robot is served; each setting is an option of the command."""

    host: str | None = None
    """Address to listen on, 127.0.0.1 unless given; any but loopback is open to the network."""
    port: int = 9090
    """Port to listen on; 0 takes a free one."""
    seed: int = 0
    """Seed of the sensor noise."""
    map: Path | None = None
    """Cloud (.ply) in which the robot localises itself; that of the scene unless given."""
    slip: Annotated[tuple[float, ...], tyro.conf.arg(metavar="S ...")] = ()
    """Times at which the wheels spin at twice their speed for a second [s]."""
    lost: bool = False
    """Start without a pose: the robot takes a hint on /initialpose, or searches the map after 5 s."""
    record: Path | None = None
    """Write all sensor readings to this file (MCAP)."""
    open: bool = False
    """Open the console page in a browser."""
    lan: bool = False
    """Listen on the network, with a token and a certificate that are made once and kept; print the page's QR code."""
    playground: bool = False
    """Let clients that may drive change the simulated world: carry, reset, pause, spin wheels, start another scene."""
    lockstep: bool = False
    """Advance time only when a client calls the service /sim/step."""
    name: str = ""
    """Name of the robot in its list of video streams; that of its platform, such as p3at, unless given."""
    camera: str | None = None
    """Carry a camera of this model: kinect, wide, small, arm; see docs/cameras.md."""
    robot: tyro.conf.OmitArgPrefixes[RobotOptions] = field(default_factory=RobotOptions)
    """Sensors and drive of the robot, and the state of its world."""
    messages: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FOLDER ...")] = ()
    """Folders with your own .msg, .srv and .action files, each named like its package."""
    ros1: bool = False
    """Use the type names of ROS 1, and its form of cbor-raw, for clients that know no other."""
    tokens: Path | None = None
    """File with the tokens of those who may connect, see docs/security.md; unless given, anybody may."""
    origins: Annotated[tuple[str, ...], tyro.conf.arg(metavar="ORIGIN ...")] = ()
    """Web pages that may connect, besides those of this machine, such as https://lab.example."""
    tls_cert: Path | None = None
    """Encrypt with this certificate and those of its issuers (PEM); needs --tls-key."""
    tls_key: Path | None = None
    """Private key of the certificate (PEM)."""
    slow_age: float = 0.5
    """Age of commands above which the robot drives slower [s]; 0 switches it off, to study delay."""
    max_age: float = 1.0
    """Age of commands above which they are refused, and the robot stops [s]; 0 switches it off."""
    guard: bool = True
    """Keep the robot from driving into what its scanners see; see docs/safety.md for what that does not protect from."""
    link: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME[=NUMBER] ...")] = ()
    """Emulate a slow link: lan, wifi-roaming, lte, starlink or geo; delay, jitter, growth, rate, stall and period, blackout
    and at, seed, up.delay=0.3 one way; trips=FILE.csv replays recorded round trips."""
    video_port: int | None = None
    """Serve the camera's streams on this port too, as web_video_server does on 8080; 0 takes a free one."""
    webrtc: bool = False
    """Offer the camera's pictures by WebRTC too, at /webrtc_viewer and POST /webrtc/offer; see docs/video.md."""
    photos: Path = Path("runs/photos")
    """Folder of the photographs that clients take with the robot's camera."""
    runs: Path = Path("runs/recorded")
    """Folder of the runs that clients record, to be looked at again in the console."""
    runs_space: float = 10.0
    """Most that they may take [GB], 15 hours of driving: the oldest that nobody keeps make room for a new one."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    """Least important messages that the terminal shows."""
    audit: Path | None = None
    """Append a line to this file for everything that clients do to the robot."""

    def __post_init__(self) -> None:
        if not 0 <= self.port <= 65535:
            raise SettingError(f"port must be 0 to 65535, got {self.port}")
        if not re.fullmatch(r"[A-Za-z0-9._-]{0,64}", self.name):
            raise SettingError(
                f"name must be at most 64 letters, digits, dots, - and _, got {self.name[:80]!r}"
            )
        if self.video_port is not None and not 0 <= self.video_port <= 65535:
            raise SettingError(f"video-port must be 0 to 65535, got {self.video_port}")
        if self.video_port is not None and self.camera is None:
            raise SettingError("--video-port needs --camera, whose streams it serves")
        if self.webrtc and self.camera is None:
            raise SettingError("--webrtc needs --camera, whose pictures it offers")
        if not (math.isfinite(self.runs_space) and self.runs_space >= 0.01):
            raise SettingError(
                f"runs-space must be at least 0.01 GB, got {self.runs_space:g}; a minute takes that"
            )
        if self.seed < 0:
            raise SettingError(f"seed must be >= 0, got {self.seed}")
        check_slip_times(self.slip)
        if not all(math.isfinite(age) and age >= 0.0 for age in (self.slow_age, self.max_age)):
            raise SettingError(
                f"slow-age and max-age must be >= 0 s, got {self.slow_age:g} and {self.max_age:g}"
            )
        if self.playground and self.lockstep:
            raise SettingError(
                "--playground is for real time; in lockstep nothing happens by itself"
            )
        _ = self.stale_limits, self.link_config
        if (self.tls_cert is None) != (self.tls_key is None):
            raise SettingError("TLS needs both, a certificate and its key")
        if self.lan and self.host in LOOPBACK:
            raise SettingError(
                f"--lan is for the network, --host {self.host} for this machine only: leave one out"
            )

    @property
    def listening_host(self) -> str:
        """Address to listen on."""
        return self.host or ("0.0.0.0" if self.lan else "127.0.0.1")

    @property
    def stale_limits(self) -> StaleLimits:
        """Limits on commands that are old when they arrive."""
        return StaleLimits(round(self.slow_age * 1e9), round(self.max_age * 1e9))

    @property
    def link_config(self) -> LinkConfig | None:
        """The emulated link; None if there is none."""
        if not self.link:
            return None
        # Imported here, since it brings the socket's libraries, which no other command needs.
        from teleop.link.emulation import LinkConfig

        return LinkConfig.parse(self.link)
