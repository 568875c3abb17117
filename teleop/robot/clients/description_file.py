"""The service ``/file_server/get_file``: the robot's description as a file, as ROS# asks for it."""

from __future__ import annotations

from typing import Any, Final

from teleop.robot.topics.topic_table import GET_FILE
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.protocol.protocol import Protocol

URDF_FILE: Final = "package://farsteer/robot.urdf"


def serve_description(protocol: Protocol, urdf: str) -> None:
    """Offer a robot's URDF on its server; its shapes need no other files."""
    content = urdf.encode()

    def get_file(client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        if request["name"] != URDF_FILE:
            raise ServiceError(f"no file {request['name'][:80]!r}; there is: {URDF_FILE}")
        return {"value": content}

    protocol.services.serve(GET_FILE.name, GET_FILE.type, get_file)
