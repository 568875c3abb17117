"""Which frames of a client must be processed in their order: those that concern the same name."""

from __future__ import annotations

from typing import Final

from teleop.rosbridge.errors import FrameError
from teleop.rosbridge.framing.json_frames import operations
from teleop.rosbridge.framing.large_frames import LARGE_FRAME, LargeFrameReader
from teleop.rosbridge.framing.operation_fields import Operation
from teleop.rosbridge.topic_names import canonical

_NAMES: Final = ("topic", "service", "action")
"""Fields of operations that name what they concern."""

_ACTION_TOPICS: Final = ("goal", "cancel", "feedback", "result", "status")
"""Last parts of the names of actionlib's topics, which together are one action."""


def concerned_names(reader: LargeFrameReader, frame: str | bytes) -> frozenset[str] | None:
    """Return the canonical names that a frame concerns; None if it may concern anything.

    A fragment concerns nothing: the message that it completes does.
    """
    try:
        if len(frame) >= LARGE_FRAME:
            name = reader.target(frame).name
            return frozenset({_name(name)} if name else ())
        read = list(operations(frame))
    except FrameError:
        return None  # the operations before the error count, and the error is answered in its turn
    if any(operation.get("op") == "auth" for operation in read):
        return None  # it changes what the frames behind it may do
    return frozenset(name for operation in read for name in _concerned(operation))


def has_payload(reader: LargeFrameReader, frame: str | bytes) -> bool:
    """Return whether a large frame has a message to be completed; a fragment has none."""
    try:
        return reader.target(frame).op != "fragment"
    except FrameError:
        return False


def _concerned(operation: Operation) -> list[str]:
    names = (operation.get(field) for field in _NAMES)
    return [_name(name) for name in names if isinstance(name, str)]


def _name(name: str) -> str:
    path = canonical(name.partition("#")[0])  # in rosbridge 1, the id of a call follows the name
    parent, _, last = path.rpartition("/")
    return parent if parent and last in _ACTION_TOPICS else path
