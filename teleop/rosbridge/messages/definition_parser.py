"""Parser of ``.msg``, ``.srv`` and ``.action`` definitions, based on rosbags."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from importlib.resources.abc import Traversable
from typing import Any, Final, TypeAlias

from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_msg
from rosbags.typesys.base import TypesysError

from teleop.rosbridge.errors import TypeNameError
from teleop.rosbridge.messages.message_types import Field, MessageType

Definition: TypeAlias = Any
"""Constants and fields in the form of rosbags' type stores."""

PADDING: Final = "structure_needs_at_least_one_member"
"""Field that ROS 2 adds to empty messages in memory and in CDR, but not in JSON."""

ENDINGS: Final = ("msg", "srv", "action")

_REST: Final = 3
"""Line of the errors of rosbags from which on they repeat what could not be parsed."""


@lru_cache(maxsize=1024)  # parsing takes 1 ms each, and every server parses the same
def parse(name: str, text: str) -> tuple[str, Definition]:
    """Return a message type's canonical name and its definition, from ``.msg`` text.

    Raises:
        TypeNameError: If the text cannot be parsed; the message is one line.
    """
    package, _, rest = name.partition("/")
    canonical = f"{package}/msg/{rest.rpartition('/')[2]}"
    try:
        return canonical, get_types_from_msg(text.strip() + "\n", canonical)[canonical]
    except (TypesysError, KeyError, ValueError) as error:
        left = (line.partition("#")[0].strip() for line in str(error).splitlines()[_REST:])
        where = next(filter(None, left), type(error).__name__)
        raise TypeNameError(
            f"the definition of {name} cannot be parsed at {where[:80]!r};"
            " a line is a type and a name, such as float64 x"
        ) from error


def parts(name: str, text: str, count: int, what: str) -> list[str]:
    """Return the parts of a ``.srv`` or ``.action`` text, which are separated by lines of dashes."""
    found = [""]
    for line in text.splitlines():
        if line.rstrip() == "---":
            found.append("")
        else:
            found[-1] += line + "\n"
    if len(found) != count:
        lines = "a line '---'" if count == 2 else f"{count - 1} lines '---'"
        raise TypeNameError(f"{name}: {what}'s definition must contain {lines}")
    return found


def message_type(name: str, definition: Definition) -> MessageType:
    """Return a definition as a MessageType."""
    constants, fields = definition
    return MessageType(
        name,
        tuple(_field(*field) for field in fields if field[0] != PADDING),
        tuple((constant, str(value)) for constant, _, value in constants),
    )


def definitions(folder: Traversable) -> Iterator[tuple[str, str, str]]:
    """Yield suffix, type name and text of each definition in a package's folder.

    The folder has the name of the package and contains the files, or ``msg``, ``srv`` and ``action``.

    Raises:
        TypeNameError: If one cannot be read.
    """
    files = []
    for entry in folder.iterdir():
        if entry.is_dir() and entry.name in ENDINGS:
            files += list(entry.iterdir())
        else:
            files.append(entry)
    for file in sorted(files, key=lambda file: file.name):
        stem, _, ending = file.name.rpartition(".")
        if stem and ending in ENDINGS:
            yield ending, f"{folder.name}/{stem}", _text(file)


def _text(file: Traversable) -> str:
    try:
        return file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no text in UTF-8"
        raise TypeNameError(f"cannot read {file}: {reason}") from error


def _field(name: str, description: Any) -> Field:
    node, content = description
    match node:
        case Nodetype.BASE:
            # JSON and CBOR have only one string type.
            kind = "string" if content[0] == "wstring" else content[0]
            return Field(name, kind, longest=content[1])
        case Nodetype.NAME:
            return Field(name, content)
        case _:
            element, size = content
            inner = _field(name, element)
            fixed = node == Nodetype.ARRAY
            return Field(
                name,
                inner.kind,
                repeated=True,
                size=size if fixed else 0,
                bound=0 if fixed else size,
                longest=inner.longest,
            )
