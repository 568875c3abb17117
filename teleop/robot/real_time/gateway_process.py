"""The gateway: sockets, parsing, judging and encoding, for a robot that is elsewhere."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import sys
from typing import TYPE_CHECKING, Final

from teleop import clock
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.audit.audit_file import AuditError
from teleop.robot.clients.activity_log import ActivityLog, configure_logging
from teleop.robot.gateway import Gateway
from teleop.robot.real_time.channel import Channel, ChannelClosedError, inherited_channel
from teleop.robot.real_time.child_process import stand_back
from teleop.robot.real_time.process_messages import (
    DRIVEN,
    ESTIMATED,
    GATEWAY_BOUND,
    OTHER,
    PREVIEW,
    PREVIEWED,
    End,
    GatewaySetup,
    ReadTokens,
    Ready,
    Wanted,
    pack,
    unpack,
)
from teleop.robot.real_time.process_name import name_process
from teleop.robot.tick_record import DriveRecord
from teleop.rosbridge.errors import RosbridgeError, ServiceError
from teleop.rosbridge.server.dated_loop import DatedEventLoop
from teleop.rosbridge.server.server import Server

if TYPE_CHECKING:  # imported only where there is a camera
    from teleop.robot.real_time.camera_receiver import CameraReceiver

_NICENESS: Final = 1
"""How far this process stands back behind control where processors are few."""

_FLUSH: Final = 0.002
"""Time for which wishes are collected before they cross [s]: a tenth of a tick."""

_SIGN_OF_LIFE: Final = 0.1
"""Period of the signs of life to control [s]."""


class GatewayProcess:
    """Joins the channel to control and a server's adapter."""

    def __init__(self, channel: Channel, setup: GatewaySetup, pictures: int | None = None) -> None:
        self._channel, self._setup, self._pictures = channel, setup, pictures
        self._ended = asyncio.Event()
        self._flushing = False
        self._activity = ActivityLog()

    async def run(self) -> None:
        """Serve until control ends."""
        loop, setup = asyncio.get_running_loop(), self._setup
        gateway = Gateway(
            setup.config,
            lambda camera: setup.latched,
            clock.monotonic,
            undo_memory=setup.undo_memory,
            scene=setup.scene,
            camera=self._camera,
            arm=ArmFit.named(setup.config.robot.arm, setup.config.robot.arm_mount),
        )
        self._gateway, self._adapter = gateway, gateway.adapter
        gateway.offer_files(setup.map_file, setup.surfaces)
        self._adapter.wishes.on_post = self._flush_soon
        self._adapter.previews.ask = lambda request: self._send(request, PREVIEW)
        protocol = gateway.server.protocol
        protocol.services.serve("/sim/step", "farsteer_msgs/srv/Step", _refuse_step)
        protocol.observers.add(self._activity)
        try:
            address = await gateway.start()
            # What is there now stays: searching it for garbage holds everybody up.
            gc.collect()
            gc.freeze()
            self._send(Ready(address))
            loop.add_reader(self._channel.fileno(), self._receive)
            await self._until_ended()
        finally:
            loop.remove_reader(self._channel.fileno())
            await gateway.close()

    def _camera(self, server: Server) -> CameraReceiver | None:
        """Return what receives the camera's pictures; imported here, since most robots have none."""
        if self._setup.camera is None:
            return None
        from teleop.robot.real_time.camera_receiver import CameraReceiver
        from teleop.robot.real_time.picture_link import PictureLink

        assert self._pictures is not None
        return CameraReceiver(PictureLink(self._pictures), self._setup.camera, server)

    async def _until_ended(self) -> None:
        """Give signs of life until control ends."""
        while not self._ended.is_set():
            self._send(Wanted())
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(_SIGN_OF_LIFE):
                    await self._ended.wait()

    def _receive(self) -> None:
        """Publish what the robot did."""
        try:
            payloads = self._channel.receive()
        except ChannelClosedError:
            self._ended.set()
            return
        for payload in payloads:
            value = unpack(payload)
            if payload[:1] == DRIVEN:
                self._driven(value)
            elif payload[:1] == ESTIMATED:
                self._gateway.estimated(value)
            elif payload[:1] == PREVIEWED:
                self._adapter.previews.answered(value)
            elif isinstance(value, ReadTokens):
                self._gateway.read_tokens()
            elif isinstance(value, End):
                self._ended.set()

    def _driven(self, tick: DriveRecord) -> None:
        self._adapter.wishes.taken(tick.taken)
        self._activity.driven(tick)
        self._gateway.driven(tick)

    def _flush_soon(self) -> None:
        if not self._flushing:
            self._flushing = True
            asyncio.get_running_loop().call_later(_FLUSH, self._flush)

    def _flush(self) -> None:
        """Send the wishes, if those before have crossed."""
        self._flushing = False
        if self._channel.waiting:
            self._flush_soon()
        self._send(
            Wanted(tuple(self._adapter.wishes.send())) if not self._channel.waiting else None
        )

    def _send(self, value: object, kind: bytes = OTHER) -> None:
        try:
            if value is None:
                self._channel.flush()
            else:
                self._channel.send(pack(kind, value))
        except ChannelClosedError:
            self._ended.set()


def _refuse_step(client: int, request: dict[str, object], now: int) -> dict[str, object]:
    raise ServiceError("time passes by itself here; farsteer serve --lockstep has this service")


def main() -> None:
    """Run in the process that control has started."""
    name_process("gateway")
    channel = inherited_channel(int(sys.argv[1]), GATEWAY_BOUND)
    setup: GatewaySetup = unpack(channel.wait()[0])
    stand_back(_NICENESS)
    configure_logging(setup.config.log_level)
    try:
        with asyncio.Runner(loop_factory=DatedEventLoop) as runner:
            pictures = int(sys.argv[2]) if len(sys.argv) > 2 else None
            runner.run(GatewayProcess(channel, setup, pictures).run())
    except (RosbridgeError, AuditError) as error:
        channel.send(pack(OTHER, error))


if __name__ == "__main__":
    main()
