"""A folder of numbered photographs with a quota; its calls may take as long as the disk does."""

from __future__ import annotations

import contextlib
import errno
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from teleop.video.photographs.photo_record import PhotoRecord, with_exif

_NAME: Final = re.compile(r"photo(0|[1-9]\d{0,8})\.jpg")

_ATTEMPTS: Final = 100
"""Numbers that are tried while another program writes into the same folder."""


class PhotoError(Exception):
    """A photograph that was not stored; the message is one line."""


@dataclass(frozen=True, slots=True)
class Photo:
    """A stored photograph."""

    name: str
    """Name of the file."""
    size: int
    """Size of the file [bytes]."""


class PhotoFolder:
    """Stores photographs as ``photo0.jpg``, ``photo1.jpg`` and so on, each with a file of JSON beside it.

    The highest number that is there is continued, so that nothing is written over. Each file appears whole or
    not at all. Only one thread at a time may call the methods that write.
    """

    def __init__(self, path: Path, *, most: int = 1000, most_bytes: int = 1_000_000_000) -> None:
        """Use a folder, which is created with the first photograph.

        Args:
            path: The folder.
            most: Number of photographs that it may hold.
            most_bytes: Size of all photographs that it may hold [bytes].
        """
        self.path = path
        self._most, self._most_bytes = most, most_bytes

    def list(self) -> list[Photo]:
        """Return all photographs in their order.

        Raises:
            PhotoError: If the folder cannot be read.
        """
        found = []
        try:
            with os.scandir(self.path) as entries:
                for entry in entries:
                    if match := _NAME.fullmatch(entry.name):
                        with contextlib.suppress(FileNotFoundError):  # removed meanwhile
                            photo = Photo(entry.name, entry.stat().st_size)
                            found.append((int(match[1]), photo))
        except FileNotFoundError:
            return []
        except OSError as error:
            raise PhotoError(f"cannot read {self.path}: {error.strerror}") from error
        return [photo for _, photo in sorted(found, key=lambda numbered: numbered[0])]

    def read(self, name: str) -> bytes | None:
        """Return a photograph or the record of one; None if there is no such file.

        Raises:
            PhotoError: If it cannot be read.
        """
        if not _NAME.fullmatch(name.removesuffix(".json") + ".jpg" * name.endswith(".json")):
            return None
        try:
            return (self.path / name).read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise PhotoError(f"cannot read {self.path / name}: {error.strerror}") from error

    def store(self, jpeg: bytes, record: PhotoRecord) -> str:
        """Store a photograph; return its name.

        Raises:
            PhotoError: If it cannot be written, or would exceed the quota; nothing of it remains.
        """
        content, beside = with_exif(jpeg, record), record.json()
        there_are = self.list()
        if len(there_are) >= self._most:
            raise PhotoError(
                f"{self.path} holds {len(there_are)} photographs, the most it may: move some away"
            )
        if sum(photo.size for photo in there_are) + len(content) > self._most_bytes:
            raise PhotoError(
                f"{self.path} would exceed {self._most_bytes / 1e6:g} MB: move some photographs away"
            )
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            first = _number(there_are[-1].name) + 1 if there_are else 0
            for number in range(first, first + _ATTEMPTS):
                with contextlib.suppress(FileExistsError):
                    return self._write(number, content, beside)
        except OSError as error:
            why = error.strerror or str(error)
            if error.errno in (errno.ENOSPC, errno.EDQUOT):
                why = "the disk is full"
            raise PhotoError(f"cannot write into {self.path}: {why}") from error
        raise PhotoError(f"{self.path} is being filled by another program")

    def _write(self, number: int, content: bytes, beside: bytes) -> str:
        """Write a photograph and its record under a number that is free.

        Raises:
            FileExistsError: If it is not free.
            OSError: If they cannot be written.
        """
        name = f"photo{number}.jpg"
        record = self.path / f"photo{number}.json"
        _write_whole(self.path / name, content)
        try:
            _write_whole(record, beside, replace=True)  # one without a photograph is no record
        except OSError:
            with contextlib.suppress(OSError):
                (self.path / name).unlink()
            raise
        return name


def _number(name: str) -> int:
    match = _NAME.fullmatch(name)
    assert match is not None
    return int(match[1])


def _write_whole(path: Path, content: bytes, *, replace: bool = False) -> None:
    """Write a file that appears whole or not at all."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if replace:
            part.replace(path)
        else:
            os.link(part, path)  # unlike a rename, it fails if the name is taken
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
