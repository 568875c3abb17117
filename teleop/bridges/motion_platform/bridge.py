"""The bridge as a whole: a robot on one side, a motion base on the other."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from teleop.bridges.endless import endless
from teleop.bridges.motion_platform.bridge_config import (
    MotionPlatformConfig,
    MotionReceiverConfig,
    host_and_port,
)
from teleop.bridges.motion_platform.datagram import (
    LATE,
    DatagramError,
    PlatformPose,
    Receiver,
    pack,
)
from teleop.bridges.motion_platform.follower import Follower
from teleop.bridges.motion_platform.limited_motion import PERIOD, settling_time
from teleop.bridges.motion_platform.platform import load_platform
from teleop.bridges.robot_client import connect, robot_client
from teleop.bridges.seldom import Seldom
from teleop.errors import SettingError
from teleop.rosbridge import Client, stamp

ATTITUDE: Final = "/motion_platform/attitude"
POSE: Final = "/motion_platform/pose"
_FRAME: Final = "motion_platform"

Say = Callable[[str], object]
"""Takes a line for the user."""


class MotionPlatformBridge:
    """Sends a pose to a motion base each period. Owns the follower and the sequence of poses."""

    def __init__(
        self, config: MotionPlatformConfig, client: Client, follower: Follower, say: Say
    ) -> None:
        """Take a client that is not connected yet.

        Raises:
            SettingError: If there is no host of the name to send to.
        """
        self._client, self._follower, self._say = client, follower, say
        self._udp, self._to = config.udp, None if config.udp is None else _look_up(config.udp)
        self._socket = socket.socket(self._to[0] if self._to else socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._faults, self._unsent = Seldom(), Seldom()
        self._following: bool | None = None

    async def run(self) -> None:
        """Send poses without end.

        Raises:
            ClientError: If the address is no robot's, or does not accept the token.
        """
        now = asyncio.get_running_loop().time
        taken = {
            "/imu/data": ("sensor_msgs/Imu", lambda m: self._follower.take_imu(m, now())),
            "/tf": ("tf2_msgs/TFMessage", self._follower.take_transforms),
            "/tf_static": ("tf2_msgs/TFMessage", self._follower.take_transforms),
            "/teleop/state": ("farsteer_msgs/TeleopState", self._follower.take_state),
        }
        for topic, (kind, take) in taken.items():
            await self._client.subscribe(topic, kind, self._guarded(topic, take))
        await self._client.advertise(ATTITUDE, "geometry_msgs/QuaternionStamped")
        await self._client.advertise(POSE, "geometry_msgs/PoseStamped")
        try:
            async with asyncio.TaskGroup() as group:
                group.create_task(connect(self._client, self._say))
                group.create_task(endless("sender of poses", self._send_poses()))
        finally:
            self._socket.close()

    def _guarded(
        self, topic: str, take: Callable[[dict[str, Any]], None]
    ) -> Callable[[dict[str, Any]], None]:
        def guarded(message: dict[str, Any]) -> None:
            try:
                take(message)
            except ValueError as error:
                self._faults.say(self._say, f"{topic}: {error}; not followed")

        return guarded

    async def _send_poses(self) -> None:
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            pose = self._follower.step(due)
            self._send(pose)
            if pose.following is not self._following:
                self._following = pose.following
                self._say("following the robot" if pose.following else "settling level")
            await self._publish(pose)
            due += PERIOD
            # What a busy machine let pass is not made up for: the platform would have to hurry.
            late = loop.time() - due
            if late > 10.0 * PERIOD:
                due += late
            await asyncio.sleep(max(0.0, due - loop.time()))

    def _send(self, pose: PlatformPose) -> None:
        if self._to is None:
            return
        try:
            self._socket.sendto(pack(pose), self._to[1])
        except OSError as error:
            self._unsent.say(self._say, f"udp {self._udp}: {error.strerror}")

    async def _publish(self, pose: PlatformPose) -> None:
        if not self._client.connected:
            return
        header = {"stamp": stamp(pose.stamp), "frame_id": _FRAME}
        x, y, z, w = Rotation.from_euler("ZYX", pose.pose[5:2:-1]).as_quat().tolist()
        quaternion = {"x": x, "y": y, "z": z, "w": w}
        place = dict(zip("xyz", pose.pose[:3].tolist(), strict=True))
        await self._client.publish(ATTITUDE, {"header": header, "quaternion": quaternion})
        both = {"position": place, "orientation": quaternion}
        await self._client.publish(POSE, {"header": header, "pose": both})


def _look_up(udp: str) -> tuple[socket.AddressFamily, Any]:
    """Return family and address of ``host:port``: once, since a look-up may take seconds, and a pose is due each 10 ms.

    Raises:
        SettingError: If there is no such host.
    """
    try:
        found = socket.getaddrinfo(*host_and_port(udp, "udp"), type=socket.SOCK_DGRAM)
    except OSError as error:
        raise SettingError(f"udp {udp}: {error.strerror}") from None
    return found[0][0], found[0][4]


async def run_motion_platform(config: MotionPlatformConfig, say: Say) -> None:
    """Run a bridge until it is cancelled.

    Raises:
        SettingError: If platform, token or certificate cannot be read, or there is no host to send to.
        ClientError: If the robot's address is no robot's, or it does not accept the token.
        PartEndedError: If a part of the bridge has ended without an error.
    """
    platform = load_platform(config.platform)
    async with robot_client(config.robot, config.token_file, config.ca, say) as client:
        say(f"{platform.title}; settles level within {settling_time(platform.limits):.1f} s")
        follower = Follower(platform, config.cueing, config.gain)
        await MotionPlatformBridge(config, client, follower, say).run()


class _Listener(asyncio.DatagramProtocol):
    """Hands datagrams to a receiver, and says what it refuses."""

    def __init__(self, receiver: Receiver, say: Say) -> None:
        self._receiver, self._say = receiver, say
        self._refused = Seldom()
        self.newest: PlatformPose | None = None
        self.at = 0.0

    def datagram_received(self, data: bytes, addr: object) -> None:
        """Take one."""
        now = asyncio.get_running_loop().time()
        try:
            self.newest = self._receiver.take(data, settled=now - self.at > LATE)
        except DatagramError as error:
            self._refused.say(self._say, f"refused: {error}")
            return
        self.at = now


async def run_motion_receiver(config: MotionReceiverConfig, say: Say) -> None:
    """Check datagrams until it is cancelled, and say each second what came.

    Raises:
        SettingError: If the platform cannot be read, or the port is taken.
    """
    receiver = Receiver(load_platform(config.platform))
    loop = asyncio.get_running_loop()
    try:
        transport, listener = await loop.create_datagram_endpoint(
            lambda: _Listener(receiver, say), local_addr=host_and_port(config.udp, "udp")
        )
    except OSError as error:
        raise SettingError(f"udp {config.udp}: {error.strerror}; is it taken?") from None
    try:
        while True:
            before = receiver.accepted
            await asyncio.sleep(1.0)
            pose = listener.newest
            if pose is None:
                say(f"waiting for datagrams on {config.udp}")
            elif loop.time() - listener.at > LATE:
                say(f"silent for {loop.time() - listener.at:.1f} s: a motion base must settle now")
            else:
                roll, pitch = np.degrees(pose.pose[3:5])
                say(
                    f"{receiver.accepted - before} poses a second, {receiver.refused} refused in all;"
                    f" roll {roll:+.1f}, pitch {pitch:+.1f} degrees"
                )
    finally:
        transport.close()
