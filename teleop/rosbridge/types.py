"""Which message and service types there are, and what they are made of.

The types of ROS 2 come from the rosbags type store; others are added as ``.msg`` and ``.srv`` text.
A message itself is a plain dict in the shape of ROS's JSON. What fills and checks one is in
``messages.py``, what writes one in ``codec.py``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from importlib.resources.abc import Traversable
from typing import Any, Final, TypeAlias

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.base import TypesysError

from teleop.rosbridge.errors import TypeNameError

Message: TypeAlias = dict[str, Any]
"""Field names to numbers, strings, arrays, lists and further messages."""

TIME: Final = "builtin_interfaces/msg/Time"
DURATION: Final = "builtin_interfaces/msg/Duration"
HEADER: Final = "std_msgs/msg/Header"

_PADDING: Final = "structure_needs_at_least_one_member"
"""What ROS 2 puts into empty messages in memory, and nobody sends."""

_SERVICES: Final = {
    "std_srvs/srv/Empty": "---",
    "std_srvs/srv/Trigger": "---\nbool success\nstring message",
    "std_srvs/srv/SetBool": "bool data\n---\nbool success\nstring message",
}


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message type."""

    name: str
    """As in the definition."""

    kind: str
    """A primitive as in ``.msg`` text (``float64``), or the canonical name of a message type."""

    repeated: bool = False
    """Whether it is an array or a sequence."""

    size: int = 0
    """Elements of a fixed array; 0 for a sequence."""

    bound: int = 0
    """Most elements of a sequence; 0 for no bound."""

    longest: int = 0
    """Most bytes of a string; 0 for no bound."""

    @property
    def nested(self) -> bool:
        """Whether it is made of messages."""
        return "/" in self.kind

    @property
    def text(self) -> str:
        """The type as in ``.msg`` text, as messages to people use it."""
        kind = short_name(self.kind) if self.nested else self.kind
        return f"{kind}[{self.size or ''}]" if self.repeated else kind


@dataclass(frozen=True, slots=True)
class MessageType:
    """What a message is made of."""

    name: str
    """Canonical: ``pkg/msg/Type``."""

    fields: tuple[Field, ...]
    """In the order of the definition."""

    constants: tuple[tuple[str, str], ...] = ()
    """Names and values, as text."""

    @property
    def names(self) -> frozenset[str]:
        """Names of the fields."""
        return frozenset(field.name for field in self.fields)


@dataclass(frozen=True, slots=True)
class ServiceType:
    """What a service takes and gives."""

    name: str
    """Canonical: ``pkg/srv/Type``."""

    request: MessageType
    response: MessageType


def short_name(name: str) -> str:
    """Return ``pkg/Type`` of ``pkg/msg/Type``: the name ROS 1 has, and people read."""
    package, _, rest = name.partition("/")
    return f"{package}/{rest.rpartition('/')[2]}"


def _field(name: str, description: Any) -> Field:
    node, content = description
    match node:
        case Nodetype.BASE:
            # JSON and CBOR have one kind of string.
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


class Registry:
    """Types by name; ``pkg/Type``, ``pkg/msg/Type`` and any case are the same name."""

    def __init__(self, folders: Iterable[Traversable] = ()) -> None:
        """Load the types of ROS 2 and those in ``folders``, each a package (see ``load``)."""
        self._types: dict[str, MessageType] = {}
        self._services: dict[str, ServiceType] = {}
        self._canonical: dict[str, str] = {}
        self._canonical_service: dict[str, str] = {}
        for name, definition in get_typestore(Stores.ROS2_JAZZY).fielddefs.items():
            self._register(name, definition)
        for name, text in _SERVICES.items():
            self.add_service(name, text)
        for folder in folders:
            self.load(folder)

    def load(self, folder: Traversable) -> None:
        """Add the ``*.msg`` and ``*.srv`` of a folder, and of ``msg`` and ``srv`` in it.

        The folder's name is the package's.
        """
        found = 0
        for file in _definitions(folder):
            stem, _, ending = file.name.rpartition(".")
            add = self.add if ending == "msg" else self.add_service
            add(f"{folder.name}/{stem}", file.read_text(encoding="utf-8"))
            found += 1
        if not found:
            raise TypeNameError(f"no .msg or .srv files in {folder}")
        self._check()

    def add(self, name: str, text: str) -> None:
        """Add or replace a message type by its ``.msg`` text."""
        self._register(*_parse(name, text))

    def add_service(self, name: str, text: str) -> None:
        """Add or replace a service type by its ``.srv`` text."""
        package, _, rest = name.partition("/")
        canonical = f"{package}/srv/{rest.rpartition('/')[2]}"
        # A line of dashes parts request and response; the padding makes one at the very edge count.
        request, line, response = f"\n{text}\n".partition("\n---\n")
        if not line:
            raise TypeNameError(f"{name}: a service's definition needs a line '---'")
        parts = [_made(*_parse(name, part)) for part in (request, response)]
        both = [
            MessageType(f"{canonical}_{end}", part.fields, part.constants)
            for end, part in zip(("Request", "Response"), parts, strict=True)
        ]
        self._services[canonical] = ServiceType(canonical, *both)
        for key in _spellings(canonical):
            self._canonical_service[key] = canonical

    def resolve(self, name: str) -> str:
        """Return the canonical ``pkg/msg/Type`` of a message type's name.

        Raises:
            TypeNameError: If there is none; the text names those that are written alike.
        """
        return _look_up(self._canonical, name, "message")

    def resolve_service(self, name: str) -> str:
        """Return the canonical ``pkg/srv/Type`` of a service type's name.

        Raises:
            TypeNameError: If there is none; the text names those that are written alike.
        """
        return _look_up(self._canonical_service, name, "service")

    def __getitem__(self, name: str) -> MessageType:
        """Return a message type by any of its names."""
        # Canonical names, which inner loops use, are found at once.
        return self._types.get(name) or self._types[self.resolve(name)]

    def service(self, name: str) -> ServiceType:
        """Return a service type by any of its names."""
        return self._services[self.resolve_service(name)]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the canonical names of the message types."""
        return iter(self._types)

    def __contains__(self, name: object) -> bool:
        """Return whether this is a name of a message type."""
        return isinstance(name, str) and name.lower() in self._canonical

    def _check(self) -> None:
        """Refuse fields of types that nobody knows, before a message has them."""
        parts = [
            part
            for service in self._services.values()
            for part in (service.request, service.response)
        ]
        for kind in (*self._types.values(), *parts):
            for field in kind.fields:
                if field.nested and field.kind not in self._types:
                    where = f"field {field.name} of {short_name(kind.name)}"
                    raise TypeNameError(f"{where} is of an unknown type {short_name(field.kind)}")

    def _register(self, name: str, definition: Any) -> None:
        self._types[name] = _made(name, definition)
        for key in _spellings(name):
            self._canonical[key] = name


def _definitions(folder: Traversable) -> list[Traversable]:
    files = []
    for entry in folder.iterdir():
        if entry.is_dir() and entry.name in ("msg", "srv"):
            files += list(entry.iterdir())
        else:
            files.append(entry)
    return sorted(
        (file for file in files if file.name.endswith((".msg", ".srv"))), key=lambda f: f.name
    )


def _parse(name: str, text: str) -> tuple[str, Any]:
    """Return a message type's canonical name and the store's form of its definition."""
    package, _, rest = name.partition("/")
    canonical = f"{package}/msg/{rest.rpartition('/')[2]}"
    try:
        return canonical, get_types_from_msg(text.strip() + "\n", canonical)[canonical]
    except (TypesysError, KeyError, ValueError) as error:
        line = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise TypeNameError(f"the definition of {name} cannot be read: {line}") from error


def _made(name: str, definition: Any) -> MessageType:
    constants, fields = definition
    return MessageType(
        name,
        tuple(_field(*field) for field in fields if field[0] != _PADDING),
        tuple((constant, str(value)) for constant, _, value in constants),
    )


def _spellings(canonical: str) -> tuple[str, str]:
    return canonical.lower(), short_name(canonical).lower()


def _look_up(canonical: dict[str, str], name: object, what: str) -> str:
    if isinstance(name, str) and (found := canonical.get(name.lower())):
        return found
    if not isinstance(name, str) or len(name) > 200:
        raise TypeNameError(f"a {what} type's name must be a short string")
    near = get_close_matches(name.lower(), canonical, n=6, cutoff=0.6)
    names = list(dict.fromkeys(short_name(canonical[key]) for key in near))
    hint = f"; did you mean {' or '.join(names)}?" if names else ""
    raise TypeNameError(f"no {what} type {name!r}{hint}")
