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
from teleop.robot.topics.topic_table import ACTIONS, INPUTS, OUTPUTS, SERVICES
from teleop.rosbridge.auth.origins import LOOPBACK

_GUARDED: Final = (
    "docs/security.md explains how clients send a token and which certificates they trust"
)

_EXAMPLE: Final = """\
drive it with roslibpy (pip install roslibpy):

{}"""

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
    """Return address, map, topics, and a client that works.

    Args:
        address: Where clients connect.
        world: The scene.
        cloud: The robot's map.
        map_path: File of the map.
        config: Settings.
        access: What was made for the network; None without ``--lan``.
    """
    lockstep = address.lockstep
    services = ", ".join(s.name for s in SERVICES if lockstep or s.name != "/sim/step")
    how = _EXAMPLE.format(snippet(address.port))
    if address.tokens or address.encrypted:
        how = _GUARDED
    return f"""\
{world.name} at {address.url}{_warning(address)}
{invitation(address, access)}
map       {map_path}
          {len(cloud.points)} points, sha256 {cloud.sha256[:16]}...
topics    {", ".join(t.name for t in OUTPUTS)}
inputs    {", ".join(t.name for t in INPUTS)}
services  {services}
actions   {", ".join(a.name for a in ACTIONS)}
{_arm(world)}{_video(address)}{_delays(config)}
{_LOCKSTEP if lockstep else how}
Ctrl-C ends."""


def _arm(world: World) -> str:
    """Return what moves the arm and what it does, a line each; empty without an arm."""
    if world.arm is None:
        return ""
    from teleop.robot.topics.arm_topics import ARM_ACTIONS, ARM_INPUTS, ARM_SERVICES

    names = ", ".join(row.name for row in (*ARM_INPUTS, *ARM_ACTIONS, *ARM_SERVICES))
    return f"arm       {world.arm.name} on its {world.arm_mount}: {names}\n"


def _video(address: Address) -> str:
    """Return the camera's topics and where its streams are, a line each; empty without a camera."""
    if not address.streams:
        return ""
    from teleop.robot.cameras.camera_topics import CAMERA_TOPICS

    names = ", ".join(topic.name for topic in CAMERA_TOPICS)
    return f"camera    {names}\nvideo     {address.streams} lists the camera's streams\n"


def _delays(config: ServeConfig) -> str:
    """Return what is out of the ordinary about delays, each in a line; empty if nothing is."""
    lines = []
    if config.link:
        lines.append(f"link      emulated: {' '.join(config.link)}")
    if not config.max_age:
        lines.append("warning: commands are obeyed however old they are (--max-age 0)")
    if not config.slow_age:
        lines.append("warning: the robot does not slow down on a slow link (--slow-age 0)")
    return "".join(f"{line}\n" for line in lines)


def _warning(address: Address) -> str:
    """Return a warning about an address that others reach; empty if there is nothing to warn of."""
    if address.host in LOOPBACK:
        return ""
    if not address.tokens:
        return (
            "\nwarning: anybody who reaches this address can drive the robot; --tokens restricts it"
        )
    if not address.encrypted:
        return "\nwarning: tokens can be read on their way here; --tls-cert and --tls-key encrypt"
    return ""


def snippet(port: int) -> str:
    """Return ten lines of roslibpy that drive forward, print the pose and receive a cloud."""
    return f"""\
import time, roslibpy
ros = roslibpy.Ros("127.0.0.1", {port})
ros.run()
pose = roslibpy.Topic(ros, "/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped", throttle_rate=500)
pose.subscribe(lambda m: print("pose", m["pose"]["pose"]["position"]))
cloud = roslibpy.Topic(ros, "/local_cloud", "sensor_msgs/PointCloud2", throttle_rate=500)
cloud.subscribe(lambda m: print("cloud of", m["width"], "points"))
joy = roslibpy.Topic(ros, "/joy", "sensor_msgs/Joy")
for forward in [0.0] * 5 + [1.0] * 30:  # a neutral stick first, then three seconds ahead
    joy.publish({{"axes": [0.0, forward], "buttons": [0, 0, 0, 0, 1]}})
    time.sleep(0.1)
ros.terminate()
"""
