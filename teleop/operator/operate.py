"""Set-up of ``farsteer operate``: client, display, connection, and the session that drives."""

from __future__ import annotations

import asyncio
import os
import ssl
import sys
from collections.abc import Callable

import numpy as np

from localization.display.rerun_sink import Sink
from localization.maps.map_files import load_cloud
from localization.types import Pose
from teleop.errors import SettingError
from teleop.interfaces import registry
from teleop.operator.display import Display
from teleop.operator.operate_config import OperateConfig
from teleop.operator.operator_client import OperatorClient
from teleop.operator.operator_session import OperatorSession
from teleop.operator.status_printer import StatusPrinter
from teleop.operator.threaded_display import ThreadedDisplay
from teleop.rosbridge.client.client import Client
from teleop.rosbridge.client.reconnecting_connection import ConnectionState


def client_for(config: OperateConfig) -> Client:
    """Return a client of the configured robot that sends the token.

    Raises:
        SettingError: If token or certificate cannot be used.
    """
    token = None
    if config.token is not None:
        token = config.token.read_text(encoding="utf-8").strip()
        if not token.isascii() or not token.isprintable() or not token:
            raise SettingError(f"{config.token} must hold a token, in one line of ASCII")
    tls = None
    if config.ca is not None:
        if not config.ca.is_file():
            raise SettingError(f"there is no certificate {config.ca}")
        try:
            tls = ssl.create_default_context(cafile=str(config.ca))
        except ssl.SSLError:
            raise SettingError(f"{config.ca} holds no certificate (PEM)") from None
    return Client(config.url, registry=registry(), token=token, tls=tls)


async def run_operator(config: OperateConfig, *, say: Callable[[str], None]) -> None:
    """Connect to a robot and operate it until the user or the duration ends it.

    Args:
        config: Robot, map and display.
        say: Prints a line for the user.

    Raises:
        CloudError: If the map cannot be read.
        ClientError: If there is no rosbridge server at the address.
        SettingError: If there is no map, or the viewer is wanted where there is no screen.
    """
    screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if config.viewer and sys.platform == "linux" and not screen:
        raise SettingError(
            "there is no screen for rerun's viewer: use --no-viewer --record FILE.rrd"
        )
    if config.map is None:
        raise SettingError("the operator needs a copy of the robot's map")
    cloud = load_cloud(config.map)
    display = None
    if config.record is not None or config.viewer:
        sink = Sink(file=config.record, spawn=config.viewer)
        display = ThreadedDisplay(Display(cloud, sink=sink), blocking=False)
    client = client_for(config)
    operator = OperatorClient(client, cloud, display, on_message=StatusPrinter(say).receive)
    loop = asyncio.get_running_loop()
    session = OperatorSession(operator, clock=lambda: int(loop.time() * 1e9), say=say)

    def connection_changed(state: ConnectionState) -> None:
        connected = state is ConnectionState.CONNECTED
        text = config.url if connected else client.closed_reason
        if not session.ended:
            say(f"{state.value}: {text}")
        if display is not None:
            display.link(connected=connected, text=text, stamp=operator.now)

    if config.duration is not None:
        loop.call_later(config.duration, session.end)
    hint = None
    if config.hint is not None:
        x, y, heading = config.hint
        hint = Pose.planar(x, y, float(np.deg2rad(heading)))
    try:
        await session.run(connection_changed=connection_changed, hint=hint, find=config.find)
    finally:
        await client.close()
        if display is not None:
            display.close()
