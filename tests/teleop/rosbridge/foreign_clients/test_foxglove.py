"""The packages of Foxglove's rosbridge data source read messages of every type in both ROS versions."""

from __future__ import annotations

import asyncio
import itertools
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from teleop.rosbridge import ClientLimits, Protocol, Server
from teleop.rosbridge.compat.standard_services import serve_standard
from teleop.rosbridge.messages.definition_parser import PADDING
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.message_defaults import BLOBS, DTYPES
from teleop.rosbridge.messages.message_types import (
    DURATION,
    HEADER,
    TIME,
    Field,
    Message,
    MessageType,
    short_name,
)
from teleop.rosbridge.messages.ros_serialization import RosVersion
from tests.teleop.rosbridge.foreign_clients.test_javascript_clients import (
    JAVASCRIPT,
    installed,
    node,
)
from tests.teleop.rosbridge.support import REGISTRY, received_on
from tests.teleop.support import in_a_loop

pytestmark = pytest.mark.process

PACKAGES = (
    *("@foxglove/roslibjs@0.0.3", "@foxglove/rosmsg@5.0.5", "ws@8"),
    *("@foxglove/rosmsg-serialization@2.0.4", "@foxglove/rosmsg2-serialization@3.1.0"),
    "tslib@2",  # a missing dependency of the reader for ROS 1
)

ROSOUT = {"ros1": "rosgraph_msgs/Log", "ros2": "rcl_interfaces/msg/Log"}


def filled(kind: MessageType, numbers: Iterator[int]) -> Message:
    """Return a message whose numbers all differ, so that exchanged fields are detected."""
    if kind.name in (TIME, DURATION):  # nanoseconds are below 2^31 in every ROS
        return {"sec": next(numbers), "nanosec": next(numbers)}
    return {field.name: value(field, numbers) for field in kind.fields}


def value(field: Field, numbers: Iterator[int]) -> Any:
    if not field.repeated:
        return element(field, numbers)
    parts = [element(field, numbers) for _ in range(field.size or min(field.bound or 2, 2))]
    if field.kind in BLOBS:
        return bytes(parts)
    return np.array(parts, DTYPES[field.kind]) if field.kind in DTYPES else parts


def element(field: Field, numbers: Iterator[int]) -> Any:
    if field.nested:
        return filled(REGISTRY[field.kind], numbers)
    number = next(numbers)
    if field.kind == "string":
        return f"é{number}"[: field.longest or None]
    if field.kind == "bool":
        return bool(number % 2)
    dtype = DTYPES[field.kind]
    if dtype.kind == "f":
        return number + 0.5
    info = np.iinfo(dtype)
    return info.max - number % 100  # high bits distinguish signed from unsigned


def as_read(kind: MessageType, message: Message, ros_version: RosVersion) -> Any:
    """Return a message in the form of Foxglove's readers."""
    if ros_version == "ros2" and kind.constants and not kind.fields:
        return {PADDING: 0}
    read = {field.name: part(field, message[field.name], ros_version) for field in kind.fields}
    return {"seq": 0, **read} if kind.name == HEADER and ros_version == "ros1" else read


def part(field: Field, found: Any, ros_version: RosVersion) -> Any:
    if field.repeated:
        return [one(field, each, ros_version) for each in found]
    return one(field, found, ros_version)


def one(field: Field, found: Any, ros_version: RosVersion) -> Any:
    if ros_version == "ros1" and field.kind in (TIME, DURATION):
        return {"sec": found["sec"], "nsec": found["nanosec"]}  # times are primitives there
    if field.nested:
        return as_read(REGISTRY[field.kind], found, ros_version)
    if ros_version == "ros1" and field.kind == "byte":  # an int8 there
        return (int(found) + 128) % 256 - 128
    if field.kind in ("int64", "uint64"):
        return str(found)
    if field.kind.startswith("float"):
        return float(found)
    return found if isinstance(found, str | bool) else int(found)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return installed(tmp_path_factory.mktemp("foxglove"), *PACKAGES)


@pytest.mark.long
@pytest.mark.slow
@node
@pytest.mark.parametrize("ros_version", ["ros1", "ros2"])
@in_a_loop
async def test_foxglove_reads_messages_of_every_type(ros_version: RosVersion, folder: Path) -> None:
    protocol = Protocol(
        REGISTRY, ros_version=ros_version, limits=ClientLimits(subscriptions=1000, messages=1000.0)
    )
    serve_standard(protocol)
    kinds = [REGISTRY[name] for name in REGISTRY]
    sent = {kind.name: complete(REGISTRY, kind, filled(kind, itertools.count())) for kind in kinds}
    async with Server(protocol, port=0) as server:
        for kind in kinds:
            server.protocol.topics.advertise(f"/all/{kind.name}", kind.name, latch=True)
            server.protocol.topics.publish(f"/all/{kind.name}", sent[kind.name], server.now)
        server.protocol.services.serve(
            "/switch", "std_srvs/SetBool", lambda *_: {"success": True, "message": "on"}
        )
        wishes = received_on(protocol, "/cmd_vel", "geometry_msgs/Twist")
        script = shutil.copy(JAVASCRIPT / "foxglove_checks.cjs", folder)
        process = await asyncio.create_subprocess_exec(
            *("node", script, server.url, "/switch", "/cmd_vel"),
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        try:
            out, complaints = await process.communicate()
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()
    assert process.returncode == 0, complaints.decode()
    said = json.loads(out)
    assert said["version"] == (1 if ros_version == "ros1" else 2)
    names = {
        kind.name: short_name(kind.name) if ros_version == "ros1" else kind.name for kind in kinds
    }
    for kind in kinds:
        assert said["read"][names[kind.name]] == as_read(kind, sent[kind.name], ros_version), (
            kind.name
        )
    assert said["nodes"].keys() == {"/rosbridge_websocket", "/client_1"}
    subscriptions, publications, services = said["nodes"]["/rosbridge_websocket"]
    assert "/cmd_vel" in subscriptions
    assert "/rosout" in publications
    assert "/switch" in services
    assert said["serviceType"] == (
        "std_srvs/SetBool" if ros_version == "ros1" else "std_srvs/srv/SetBool"
    )
    assert said["answer"] == {"success": True, "message": "on"}
    assert [wish["linear"]["x"] for wish in wishes] == [0.5]
