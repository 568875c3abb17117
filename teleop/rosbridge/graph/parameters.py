"""Parameters: JSON values by name, as ROS keeps them for whoever asks."""

from __future__ import annotations

import json
from typing import Any, Final

from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.framing.json_frames import read_json

_MOST: Final = 1000
_LARGEST: Final = 65_536
"""Of one value's text [characters]."""


class Parameters:
    """Values by name; a name with ``/`` in it lies in a namespace, which has a value as well.

    Names of ROS 2 (``node:parameter``) and of ROS 1 (``/node/parameter``) are different names.
    """

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}

    @property
    def names(self) -> list[str]:
        """Of those that are set."""
        return sorted(self._values)

    def get(self, name: str) -> Any:
        """Return a value; of a namespace, all in it as a dict; None if there is neither.

        A parameter in ROS is never null, so nothing else is None.
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
        """Set a value, in the place of a namespace of this name, or of a value where one is to be.

        Raises:
            ServiceError: If there are too many already, or the name is none.
        """
        key = _key(name)
        if key == "/":
            raise ServiceError("a parameter needs a name")
        if value is None:
            self.delete(name)
            return
        above = [other for other in self._values if key.startswith(other + "/")]
        for other in (*self._inside(key), *above):
            del self._values[other]
        if key not in self._values and len(self._values) >= _MOST:
            raise ServiceError(f"at most {_MOST} parameters can be set")
        self._values[key] = value

    def delete(self, name: str) -> bool:
        """Forget a value, or all in a namespace; return whether there was any."""
        key = _key(name)
        gone = [other for other in (key, *self._inside(key)) if other in self._values]
        for other in gone:
            del self._values[other]
        return bool(gone)

    def _inside(self, key: str) -> list[str]:
        start = key.rstrip("/") + "/"
        return [other for other in self._values if other.startswith(start)]


def read_value(text: str) -> Any:
    """Return what JSON text says; what is not JSON stands for itself, as rosapi has it."""
    if len(text) > _LARGEST:
        raise ServiceError(f"a parameter has at most {_LARGEST} characters")
    try:
        value = read_json(text)
        write_value(value)  # which finds numbers too large to be written again
    except ValueError:
        return text
    return value


def write_value(value: Any) -> str:
    """Return a value as JSON text."""
    return json.dumps(value, allow_nan=False)


def _key(name: str) -> str:
    key = "/" + name.strip("/")
    if len(key) > 256:
        raise ServiceError("a parameter's name has at most 255 characters")
    return key
