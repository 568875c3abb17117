"""How many may watch at a time, and in how many formats."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from http import HTTPStatus
from typing import Final, TypeVar

from teleop.pictures.picture import PictureFormat
from teleop.video.refusal import VideoRefusedError

MAX_FORMATS: Final = 4
"""Different pictures that are encoded at a time, by picture, size and quality."""

MAX_OF_ADDRESS: Final = 10
"""Viewers of one address; snapshots that are waited for count too."""

MAX_VIEWERS: Final = 32
"""Viewers in all."""


_K = TypeVar("_K")


class ViewerPlaces:
    """Counts viewers by address and by format."""

    def __init__(self) -> None:
        self._of_address: Counter[str] = Counter()
        self._of_format: Counter[PictureFormat] = Counter()

    def take(self, address: str, wanted: PictureFormat) -> Callable[[], None]:
        """Admit a viewer; return what gives its place back, once however often it is called.

        Raises:
            VideoRefusedError: If there is no place; the line says what would work.
        """
        if self._of_address[address] >= MAX_OF_ADDRESS:
            line = f"{MAX_OF_ADDRESS} viewers of this address watch already: close one"
            raise VideoRefusedError(HTTPStatus.TOO_MANY_REQUESTS, line, Retry_After="10")
        if self._of_address.total() >= MAX_VIEWERS:
            line = f"{MAX_VIEWERS} viewers watch already"
            raise VideoRefusedError(HTTPStatus.SERVICE_UNAVAILABLE, line, Retry_After="10")
        if wanted not in self._of_format and len(self._of_format) >= MAX_FORMATS:
            there_are = "; ".join(_fields(each) for each in self._of_format)
            line = f"{MAX_FORMATS} sizes and qualities are watched already, ask for one of these: {there_are}"
            raise VideoRefusedError(HTTPStatus.SERVICE_UNAVAILABLE, line, Retry_After="10")
        self._of_address[address] += 1
        self._of_format[wanted] += 1
        taken = [True]

        def leave() -> None:
            if taken:
                taken.clear()
                _take_one(self._of_address, address)
                _take_one(self._of_format, wanted)

        return leave


def _take_one(counter: Counter[_K], key: _K) -> None:
    counter[key] -= 1
    if not counter[key]:
        del counter[key]


def _fields(wanted: PictureFormat) -> str:
    """Return a format in the fields of an address."""
    invert = "&invert" if wanted.inverted else ""
    size = f"width={wanted.width}&height={wanted.height}"
    return f"topic={wanted.topic}&quality={wanted.quality}&{size}{invert}"
