"""ROS parameters: JSON values by name."""

from __future__ import annotations

import json
from typing import Any, Final

from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.framing.json_frames import read_json
from teleop.rosbridge.topic_names import canonical

_MAX_PARAMETERS: Final = 1000
_MAX_LENGTH: Final = 65_536
"""Length of the text of one value [characters]."""

_MAX_TOTAL: Final = 262_144
"""Length of the texts of all values [characters], which one call may ask for."""


class Parameters:
    """Values by name; ``/`` separates namespaces, which have a value as well.

    The names of ROS 2 (``node:parameter``) and of ROS 1 (``/node/parameter``) are different.
    """

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}
        self._sizes: dict[str, int] = {}
        """Length of each value's text."""

        self._size = 0

    @property
    def names(self) -> list[str]:
        """Names of all parameters that are set."""
        return sorted(self._values)

    def get(self, name: str) -> Any:
        """Return a value, or a namespace as a nested dict; None if there is neither.

        A ROS parameter is never null, so None is unambiguous.
        """
        key = _key(name)
        if key in self._values:
            return self._values[key]
        found: dict[str, Any] = {}
        for other in self._inside(key):
            inner = found
            *path, last = other.removeprefix(key).strip("/").split("/")
            for part in path:
                inner = inner.setdefault(part, {})
            inner[last] = self._values[other]
        return found or None

    def set(self, name: str, value: Any) -> None:
        """Set a value; it replaces a namespace of its name and values of its parent namespaces.

        Raises:
            ServiceError: If there are too many parameters, they are too large together, or the name
                is empty.
        """
        key = _key(name)
        if key == "/":
            raise ServiceError("the name of a parameter must not be empty")
        if value is None:
            self.delete(name)
            return
        above = [other for other in self._values if key.startswith(other + "/")]
        replaced = [*self._inside(key), *above, *([key] if key in self._values else [])]
        size = len(write_value(value))
        if len(self._values) - len(replaced) >= _MAX_PARAMETERS:
            raise ServiceError(f"at most {_MAX_PARAMETERS} parameters may be set")
        if self._size - sum(self._sizes[other] for other in replaced) + size > _MAX_TOTAL:
            raise ServiceError(f"all parameters together may have at most {_MAX_TOTAL} characters")
        for other in replaced:
            self._remove(other)
        self._values[key], self._sizes[key] = value, size
        self._size += size

    def delete(self, name: str) -> bool:
        """Delete a value, or all in a namespace; return whether there was any."""
        key = _key(name)
        gone = [other for other in (key, *self._inside(key)) if other in self._values]
        for other in gone:
            self._remove(other)
        return bool(gone)

    def _remove(self, key: str) -> None:
        del self._values[key]
        self._size -= self._sizes.pop(key)

    def _inside(self, key: str) -> list[str]:
        start = key.rstrip("/") + "/"
        return [other for other in self._values if other.startswith(start)]


def read_value(text: str) -> Any:
    """Return the value of a JSON text; other text is a string, as in rosapi."""
    if len(text) > _MAX_LENGTH:
        raise ServiceError(f"a parameter value may have at most {_MAX_LENGTH} characters")
    try:
        value = read_json(text)
        write_value(value)  # rejects numbers that are too large to be written
    except ValueError:
        return text
    return value


def write_value(value: Any) -> str:
    """Return a value as JSON text."""
    return json.dumps(value, allow_nan=False)


def _key(name: str) -> str:
    key = canonical(name)
    if len(key) > 256:
        raise ServiceError("a parameter name may have at most 255 characters")
    return key
