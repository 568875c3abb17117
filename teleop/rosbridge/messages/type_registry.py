"""Registry of the known message, service and action types."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from importlib.resources.abc import Traversable
from typing import Final

from rosbags.typesys import Stores, get_typestore

from teleop.rosbridge.errors import TypeNameError
from teleop.rosbridge.messages import builtin_types, manipulation_types
from teleop.rosbridge.messages.definition_parser import (
    Definition,
    definitions,
    message_type,
    parse,
    parts,
)
from teleop.rosbridge.messages.message_types import ActionType, MessageType, ServiceType, short_name

_ACTIONLIB: Final = {
    "ActionGoal": "std_msgs/Header header\nactionlib_msgs/GoalID goal_id\n{0}Goal goal",
    "ActionResult": "std_msgs/Header header\nactionlib_msgs/GoalStatus status\n{0}Result result",
    "ActionFeedback": (
        "std_msgs/Header header\nactionlib_msgs/GoalStatus status\n{0}Feedback feedback"
    ),
    "Action": (
        "{0}ActionGoal action_goal\n{0}ActionResult action_result\n{0}ActionFeedback action_feedback"
    ),
}
"""Messages of the topics of an action in ROS 1."""

_COMMON_PREFIX: Final = 4
"""Letters that a misspelt name shares with a suggestion, unless the last part is the same."""

_LENGTH_DIFFERENCE: Final = 6
"""Largest difference in length between a misspelt name and a suggestion [letters]."""


class TypeRegistry:
    """Types by name; ``pkg/Type`` and ``pkg/msg/Type`` are the same name, as is any case.

    It contains the types of ROS 2 Jazzy, those of ROS 1 Noetic that Jazzy lacks, those in
    ``builtin_types`` and ``manipulation_types``, and those that are added.
    """

    def __init__(self, folders: Iterable[Traversable] = ()) -> None:
        """Load the types of ROS and those in ``folders``, see ``load``."""
        self.version = 0
        """Number that changes when a message type is added or replaced."""

        self._types: dict[str, MessageType] = {}
        self._definitions: dict[str, Definition] = {}
        self._services: dict[str, ServiceType] = {}
        self._actions: dict[str, ActionType] = {}
        self._canonical: dict[str, str] = {}
        self._canonical_service: dict[str, str] = {}
        self._canonical_action: dict[str, str] = {}
        self._nested: dict[str, int] = {}
        """Numbers of nested messages that have been asked for."""

        for store in (Stores.ROS2_JAZZY, Stores.ROS1_NOETIC):
            for name, definition in get_typestore(store).fielddefs.items():
                if name not in self._types:
                    self._register(name, definition)
        for more in (builtin_types, manipulation_types):
            for name, text in more.MESSAGES.items():
                self.add(name, text)
            for name, text in more.SERVICES.items():
                self.add_service(name, text)
            for name, text in more.ACTIONS.items():
                self.add_action(name, text)
        for folder in folders:
            self.load(folder)

    def load(self, folder: Traversable) -> None:
        """Add the ``*.msg``, ``*.srv`` and ``*.action`` files of a package, or of several.

        A package is a folder of its name that contains the files directly or in ``msg``, ``srv``
        and ``action``. ``folder`` is such a folder, or contains several.

        Raises:
            TypeNameError: If there are no files, one cannot be read or parsed, or a field's type is unknown.
        """
        if not folder.is_dir():
            raise TypeNameError(f"{folder} is not a folder")
        found = list(definitions(folder))
        if not found:
            packages = sorted((e for e in folder.iterdir() if e.is_dir()), key=lambda e: e.name)
            found = [each for package in packages for each in definitions(package)]
        if not found:
            raise TypeNameError(f"no .msg, .srv or .action files in {folder}")
        add = {"msg": self.add, "srv": self.add_service, "action": self.add_action}
        for ending, name, text in found:
            add[ending](name, text)
        self._check()

    def add(self, name: str, text: str) -> None:
        """Add or replace a message type by its ``.msg`` text."""
        self._register(*parse(name, text))

    def add_service(self, name: str, text: str) -> None:
        """Add or replace a service type by its ``.srv`` text."""
        canonical = _canonical(name, "srv")
        both = self._parts(name, canonical, text, ("Request", "Response"), "a service")
        self._services[canonical] = ServiceType(canonical, *both)
        for key in _spellings(canonical):
            self._canonical_service[key] = canonical

    def add_action(self, name: str, text: str) -> None:
        """Add or replace an action type by its ``.action`` text, and its actionlib messages."""
        canonical = _canonical(name, "action")
        ends = ("Goal", "Result", "Feedback")
        three = self._parts(name, canonical, text, ends, "an action")
        self._actions[canonical] = ActionType(canonical, *three)
        for key in _spellings(canonical):
            self._canonical_action[key] = canonical
        short = short_name(canonical)
        for end, part in zip(ends, parts(name, text, 3, "an action"), strict=True):
            self.add(f"{short}{end}", part)
        for end, part in _ACTIONLIB.items():
            self.add(f"{short}{end}", part.format(short))

    def resolve(self, name: str) -> str:
        """Return the canonical ``pkg/msg/Type`` of a message type's name.

        Raises:
            TypeNameError: If the name is unknown; the text suggests similar names.
        """
        return _look_up(self._canonical, name, "message")

    def resolve_service(self, name: str) -> str:
        """Return the canonical ``pkg/srv/Type`` of a service type's name, or raise TypeNameError."""
        return _look_up(self._canonical_service, name, "service")

    def resolve_action(self, name: str) -> str:
        """Return the canonical ``pkg/action/Type`` of an action type's name, or raise TypeNameError."""
        return _look_up(self._canonical_action, name, "action")

    def __getitem__(self, name: str) -> MessageType:
        """Return a message type by any of its names."""
        # The fast path of canonical names, which inner loops use.
        return self._types.get(name) or self._types[self.resolve(name)]

    def nested_messages(self, name: str) -> int:
        """Return of how many messages the default of a message type consists, itself included."""
        found = self._nested.get(name)
        if found is None:
            fields = (field for field in self[name].fields if field.nested)
            found = self._nested[name] = 1 + sum(
                self.nested_messages(field.kind) * (field.size if field.repeated else 1)
                for field in fields
            )
        return found

    def definition(self, name: str) -> Definition:
        """Return the definition of a message type, in the form of rosbags' type stores."""
        return self._definitions[self.resolve(name)]

    def service(self, name: str) -> ServiceType:
        """Return a service type by any of its names."""
        return self._services[self.resolve_service(name)]

    def action(self, name: str) -> ActionType:
        """Return an action type by any of its names."""
        return self._actions[self.resolve_action(name)]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the canonical names of the message types."""
        return iter(self._types)

    def __contains__(self, name: object) -> bool:
        """Return whether this is a name of a message type."""
        return isinstance(name, str) and name.lower() in self._canonical

    def _check(self) -> None:
        """Reject fields of unknown types."""
        inner = [part for s in self._services.values() for part in (s.request, s.response)]
        for kind in (*self._types.values(), *inner):
            for field in kind.fields:
                if field.nested and field.kind not in self._types:
                    where = f"field {field.name} of {short_name(kind.name)}"
                    raise TypeNameError(f"{where} has the unknown type {short_name(field.kind)}")

    def _parts(
        self, name: str, canonical: str, text: str, ends: tuple[str, ...], what: str
    ) -> list[MessageType]:
        made = [message_type(*parse(name, part)) for part in parts(name, text, len(ends), what)]
        return [
            MessageType(f"{canonical}_{end}", part.fields, part.constants)
            for end, part in zip(ends, made, strict=True)
        ]

    def _register(self, name: str, definition: Definition) -> None:
        self._nested.clear()
        self.version += 1
        self._types[name] = message_type(name, definition)
        self._definitions[name] = definition
        for key in _spellings(name):
            self._canonical[key] = name


def _canonical(name: str, middle: str) -> str:
    package, _, rest = name.partition("/")
    return f"{package}/{middle}/{rest.rpartition('/')[2]}"


def _spellings(canonical: str) -> tuple[str, str]:
    return canonical.lower(), short_name(canonical).lower()


def _look_up(canonical: dict[str, str], name: object, what: str) -> str:
    if isinstance(name, str) and (found := canonical.get(name.lower())):
        return found
    if not isinstance(name, str) or len(name) > 200:
        raise TypeNameError(f"the name of a {what} type must be a short string")
    wanted = name.lower()
    last = wanted.rpartition("/")[2]
    # Comparing with all names takes 15 ms, which a flood of wrong names could exploit.
    alike = [
        key
        for key in canonical
        if (
            key[:_COMMON_PREFIX] == wanted[:_COMMON_PREFIX]
            and abs(len(key) - len(wanted)) <= _LENGTH_DIFFERENCE
        )
        or key.rpartition("/")[2] == last
    ]
    near = get_close_matches(wanted, alike, n=6, cutoff=0.6)
    names = list(dict.fromkeys(short_name(canonical[key]) for key in near))
    hint = f"; did you mean {' or '.join(names)}?" if names else ""
    raise TypeNameError(f"unknown {what} type {name!r}{hint}")
