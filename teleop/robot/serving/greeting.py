"""Text that ``farsteer serve`` prints once clients can connect."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.robot.serving.address import Address
from teleop.robot.serving.lan_access import LanAccess
from teleop.robot.serving.page_invitation import invitation
from teleop.robot.serving.serve_config import ServeConfig
from teleop.rosbridge.auth.origins import LOOPBACK

_GUARDED: Final = (
    "docs/security.md explains how clients send a token and which certificates they trust"
)

_LOCKSTEP: Final = (
    "time stands still until a client calls /sim/step; docs/teleoperation.md has an example"
)


def greeting(
    address: Address,
    world: World,
    cloud: Cloud,
    map_path: Path,
    config: ServeConfig,
    access: LanAccess | None = None,
) -> str:
    """Return what is served, and as the last thing where to open it: all fits a terminal of 24 lines.

    Args:
        address: Where clients connect.
        world: The scene.
        cloud: The robot's map.
        map_path: File of the map.
        config: Settings.
        access: What was made for the network; None without ``--lan``.
    """
    guarded = f"tokens    {_GUARDED}\n" if address.tokens or address.encrypted else ""
    stands = f"time      {_LOCKSTEP}\n" if address.lockstep else ""
    return f"""\
{world.name} at {address.url}
map       {map_path}, {len(cloud.points)} points
clients   any rosbridge client: docs/topics.md lists the topics, README.md has a program
{_arm(world)}{_video(address)}{_unusual(config)}{guarded}{stands}{_warning(address)}Ctrl-C ends.
{invitation(address, access)}"""


def _arm(world: World) -> str:
    """Return which arm there is, a line; empty without one."""
    if world.arm is None:
        return ""
    return f"arm       {world.arm.name} on its {world.arm_mount}\n"


def _video(address: Address) -> str:
    """Return where the camera's streams are, a line; empty without a camera."""
    return address.streams and f"video     {address.streams} lists the camera's streams\n"


def _unusual(config: ServeConfig) -> str:
    """Return what is out of the ordinary about delays and the guard, each in a line; empty if nothing is."""
    lines = []
    if config.link:
        lines.append(f"link      emulated: {' '.join(config.link)}")
    if not config.max_age:
        lines.append("warning: commands are obeyed however old they are (--max-age 0)")
    if not config.slow_age:
        lines.append("warning: the robot does not slow down on a slow link (--slow-age 0)")
    if not config.guard:
        lines.append("warning: nothing keeps the robot from obstacles (--no-guard)")
    return "".join(f"{line}\n" for line in lines)


def _warning(address: Address) -> str:
    """Return a warning about an address that others reach; empty if there is nothing to warn of."""
    if address.host in LOOPBACK:
        return ""
    if not address.tokens:
        return (
            "warning: anybody who reaches this address can drive the robot; --tokens restricts it\n"
        )
    if not address.encrypted:
        return "warning: tokens can be read on their way here; --tls-cert and --tls-key encrypt\n"
    return ""
