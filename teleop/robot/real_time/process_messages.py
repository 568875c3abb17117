"""What crosses between the processes of a robot in real time.

Control is the parent of all others, and everything but pictures goes through it. Records cross as they are;
a byte before each says what it is, so that estimates can be passed on unread.
"""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from localization.maps.cloud import Cloud
from localization.types import Mounts
from teleop.robot.inbox import InboxMessage
from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.topics.message_parts import Message
from teleop.robot.topics.topic_table import Interface

if TYPE_CHECKING:  # the camera is imported only where there is a camera
    from robot_sim.cameras import CameraModel
    from robot_sim.cameras.renderer import CameraScene

DRIVEN: Final = b"D"
"""A ``DriveRecord``, from control to the gateway and to the estimator."""

ESTIMATED: Final = b"E"
"""An ``EstimateRecord``, from the estimator to control, which passes it on to the gateway."""

PREVIEW: Final = b"P"
"""A ``PreviewRequest``, from the gateway to control, which passes it on unread to the estimator."""

PREVIEWED: Final = b"Q"
"""A ``PreviewAnswer``, on the same way back."""

STATE: Final = b"S"
"""A ``VisualState``, from control to the camera."""

NEXT_STATE: Final = b"N"
"""Alone, from the camera to control: it wants the state of the next frame."""

OTHER: Final = b"O"
"""One of the classes below, or an exception that ended the process before it was ready."""

GATEWAY_BOUND: Final = 4_000_000
"""Bytes of records that may wait for the gateway: some seconds of them."""

ESTIMATOR_BOUND: Final = 16_000_000
"""Bytes of records that may wait for the estimator: half a minute of them, since a gap costs the pose."""

CAMERA_BOUND: Final = 1_000_000
"""Bytes that may wait for the camera, beside its first message: it asks for one state at a time."""


@dataclass(frozen=True, slots=True)
class GatewaySetup:
    """What the gateway needs to begin."""

    config: ServeConfig
    scene: str
    """Name of the scene."""
    latched: Mapping[Interface, Message]
    """Messages that are published once."""
    map_file: Path | None
    """File that is offered as ``/map.ply``, and by its hash."""
    undo_memory: int
    """Time for which a placement can be undone [ns]."""
    camera: CameraModel | None = None
    """The robot's camera; None without one."""
    surfaces: bytes | None = None
    """The map's surfaces, a GLB file that is offered as ``/map.glb``; None for none."""


@dataclass(frozen=True, slots=True, eq=False)
class EstimatorSetup:
    """What the estimator needs to begin."""

    cloud: Cloud
    """The map."""
    mounts: Mounts
    """``base_from_scanner`` by the scanner's frame."""
    cache: Path | None
    """Folder for derived files."""
    record: Path | None
    """Log to write, of what the localiser is given."""
    metadata: Mapping[str, str]
    """Metadata of that log."""
    wheel_radius: float
    """Radius by which wheel speeds are logged as rates [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class CameraSetup:
    """What the camera's process needs to begin."""

    scene: CameraScene
    """The world, as a camera sees it."""
    model: CameraModel
    """The camera."""


@dataclass(frozen=True, slots=True)
class Ready:
    """The process has begun; the gateway says where it listens."""

    address: Address | None = None


@dataclass(frozen=True, slots=True)
class Wanted:
    """What clients want, in order; empty as a sign of life."""

    messages: tuple[InboxMessage, ...] = ()


@dataclass(frozen=True, slots=True)
class ReadTokens:
    """The token file is to be read again."""


@dataclass(frozen=True, slots=True)
class End:
    """The process is to end in order."""


def pack(kind: bytes, value: object) -> bytes:
    """Return a value as a payload."""
    return kind + pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)


def unpack(payload: bytes) -> Any:
    """Return the value of a payload; both processes are the robot's own."""
    return pickle.loads(memoryview(payload)[1:])
