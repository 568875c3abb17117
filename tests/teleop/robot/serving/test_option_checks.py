"""What ``farsteer serve`` refuses before it loads a world."""

from __future__ import annotations

import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from localization.errors import LocalizationError
from robot_sim.errors import CameraError
from teleop.errors import TeleopError
from teleop.robot.commands import Serve
from teleop.robot.serving.robot_options import RobotOptions
from teleop.robot.serving.serve_config import ServeConfig
from teleop.rosbridge import ServerError
from teleop.rosbridge.errors import RosbridgeError


class WorldWasLoaded(Exception):
    """Nothing was refused."""


@pytest.fixture(autouse=True)
def world_that_must_not_be_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    def world(*_: object, **spares: object) -> None:
        raise WorldWasLoaded

    monkeypatch.setattr(RobotOptions, "world", world)


@pytest.fixture
def taken_port() -> Iterator[int]:
    with socket.create_server(("127.0.0.1", 0)) as holder:
        yield holder.getsockname()[1]


def serve(**settings: Any) -> None:
    Serve(server=ServeConfig(**{"port": 0, **settings}))()


FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "tokens that are not there": ({"tokens": Path("none.toml")}, "cannot read the tokens"),
    "messages that are not there": ({"messages": (Path("none_msgs"),)}, "is not a folder"),
    "something that is no origin": ({"origins": ("lab",)}, "'lab' is not a valid origin"),
    "an address of another machine": ({"host": "192.0.2.1"}, "cannot listen on port"),
    "a camera that there is not": ({"camera": "kinetc"}, "available: kinect"),
    "an audit log in no folder": ({"audit": Path("none/audit")}, "cannot write the audit log"),
    "a certificate that is not there": (
        {"tls_cert": Path("none.crt"), "tls_key": Path("none.key")},
        "none.crt",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_options_that_cannot_be_served_are_refused_before_a_world_is_loaded(
    fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    settings, reason = FAULTS[fault]
    with pytest.raises((TeleopError, CameraError, RosbridgeError), match=reason):
        serve(**settings)


def test_taken_port_is_refused_before_a_world_is_loaded(taken_port: int) -> None:
    with pytest.raises(ServerError, match=rf"port {taken_port} of 127\.0\.0\.1 is in use"):
        serve(port=taken_port)


def test_camera_without_its_library_names_the_line_that_installs_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "OpenGL", None)
    with pytest.raises(LocalizationError, match=r"--camera needs OpenGL: .*pip install .*camera"):
        serve(camera="kinect")


def test_options_that_can_be_served_leave_their_port_free() -> None:
    with socket.create_server(("127.0.0.1", 0)) as holder:
        port = holder.getsockname()[1]
    for _ in range(2):
        with pytest.raises(WorldWasLoaded):
            serve(port=port, camera="small")
    socket.create_server(("127.0.0.1", port)).close()
