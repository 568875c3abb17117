"""Set-up of ``farsteer operate``: client, display, connection, and the session that drives."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Callable
from urllib.parse import urlsplit, urlunsplit

from localization.display.rerun_sink import Sink
from teleop.errors import SettingError
from teleop.operator.controls.pygame_pads import open_pads
from teleop.operator.display.display import Display
from teleop.operator.display.restarting_display import RestartingDisplay, recording_of
from teleop.operator.display.threaded_display import LiveThreadedDisplay
from teleop.operator.map_download import MapLibrary
from teleop.operator.named_places import pose_of, read_places
from teleop.operator.operate_config import OperateConfig
from teleop.operator.operator_client import CAMERA, TOPICS, WATCHED, OperatorClient
from teleop.operator.operator_session import OperatorSession
from teleop.operator.robot_state.event_list import EventList
from teleop.operator.robot_state.link_words import plain_reason
from teleop.ros_types import registry
from teleop.rosbridge.client.client import Client
from teleop.rosbridge.client.reconnecting_connection import ConnectionState
from teleop.secret_files import read_secret, trust


def client_for(config: OperateConfig) -> Client:
    """Return a client of the configured robot that sends the token.

    Raises:
        SettingError: If token or certificate cannot be used.
    """
    return Client(
        config.url,
        registry=registry(),
        token=read_secret(config.token, "token"),
        tls=trust(config.ca),
    )


def page_address(url: str) -> str:
    """Return where a robot at a WebSocket's address serves its page."""
    parts = urlsplit(url)
    scheme = "https" if parts.scheme == "wss" else "http"
    return urlunsplit((scheme, parts.netloc, "/", "", ""))


async def run_operator(config: OperateConfig, *, say: Callable[[str], None]) -> int:
    """Connect to a robot and operate it until the user or the duration ends it.

    Args:
        config: Robot, map and display.
        say: Prints a line for the user.

    Returns:
        0, or 1 if a hint was to be given and was not taken.

    Raises:
        ClientError: If there is no rosbridge server at the address.
        SettingError: If a file cannot be used, or the viewer is wanted where there is no screen.
    """
    screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if config.viewer and sys.platform == "linux" and not screen:
        raise SettingError(
            "there is no screen for rerun's viewer: use --no-viewer --record FILE.rrd,"
            " or open the robot's own page in a browser"
        )
    if config.map is not None and not config.map.is_file():
        raise SettingError(f"there is no map {config.map}; without --map the robot's is fetched")
    places = None if config.places is None else read_places(config.places)
    client = client_for(config)
    display = _display(config)
    loop = asyncio.get_running_loop()
    on_terminal = sys.stdin.isatty() and sys.stdout.isatty()
    events = EventList(None if on_terminal else say)
    operator = OperatorClient(
        client,
        None,
        display,
        topics={**TOPICS, **WATCHED, **(CAMERA if config.camera else {})},
        on_message=lambda topic, message: session.receive(topic, message),
    )
    session = OperatorSession(
        operator,
        clock=lambda: int(loop.time() * 1e9),
        events=events,
        display=display,
        maps=None if display is None else _maps(config),
        places=places,
        pads=open_pads() if on_terminal else None,
    )

    page_named = False

    def connection_changed(state: ConnectionState) -> None:
        nonlocal page_named
        connected = state is ConnectionState.CONNECTED
        if connected and not page_named:
            page_named = True
            events.add(
                f"the robot's own page, to drive from any browser: {page_address(config.url)}"
            )
        text = config.url if connected else plain_reason(client.closed_reason)
        if display is not None:
            display.link(connected=connected, text=text, stamp=operator.now)

    if config.duration is not None:
        loop.call_later(config.duration, session.end)
    hint = None if config.hint is None else pose_of(list(config.hint))
    try:
        await session.run(connection_changed=connection_changed, hint=hint, find=config.find)
    finally:
        await client.close()
        if display is not None:
            display.close()
        # What was counted, or shown on a screen that is gone, stays on the terminal.
        for event in events.last(20) if on_terminal else events.repeated:
            say(str(event))
    if hint is None or session.hints.taken:
        return 0
    if session.hints.verdict is None:
        say("the hint was not answered")
    return 1


def _display(config: OperateConfig) -> LiveThreadedDisplay | None:
    """Return the display that the settings ask for."""
    if config.record is None and not config.viewer:
        return None

    def make(run: int) -> Display:
        file = None if config.record is None else recording_of(config.record, run)
        sink = Sink(file=file, spawn=config.viewer)
        return Display(
            None, sink=sink, live=True, camera=config.camera, path_ahead=config.path_ahead
        )

    return LiveThreadedDisplay(RestartingDisplay(make))


def _maps(config: OperateConfig) -> MapLibrary:
    """Return where the robot's map comes from."""
    return MapLibrary(
        config.url, own=config.map, token=read_secret(config.token, "token"), tls=trust(config.ca)
    )
