"""Takes photographs: waits for a picture, and has a thread store it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final, TypeVar

from teleop.pictures.picture import Picture, PictureFormat
from teleop.video.photographs.photo_folder import Photo, PhotoError, PhotoFolder
from teleop.video.photographs.photo_record import PhotoPose, PhotoRecord

QUALITY: Final = 95
"""Quality of a photograph's JPEG."""

_MAX_WAITING: Final = 4
"""Photographs that are being taken at a time; further ones are refused."""

_DISK_TIMEOUT: Final = 10.0
"""Time for which somebody waits for the disk [s]; what it does goes on in its thread."""

_LOG: Final = logging.getLogger(__name__)

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class TakenPhoto:
    """A photograph that is stored."""

    name: str
    """Name of its file."""
    stamp: int
    """Robot time at which the camera saw it [ns]."""


@dataclass(frozen=True, slots=True)
class PhotoContext:
    """What a photographer knows besides the picture."""

    pose_at: Callable[[int], PhotoPose | None]
    """Returns where the robot was at a stamp [ns]."""
    date: Callable[[], str]
    """Returns date and time in UTC."""
    map_name: str
    """Name of the robot's map."""
    map_sha256: str
    """Hash of its file."""


class Photographer:
    """Owns the folder's thread, so that a slow disk holds up nothing but photographs."""

    def __init__(
        self,
        folder: PhotoFolder,
        wanted: PictureFormat,
        next_picture: Callable[[PictureFormat], Awaitable[Picture]],
        context: PhotoContext,
    ) -> None:
        """Prepare to take photographs.

        Args:
            folder: Where they are stored.
            wanted: Format of the camera's full picture.
            next_picture: Returns the first picture after the call; raises TimeoutError if none comes.
            context: What else is known.
        """
        self._folder, self._wanted, self._next = folder, wanted, next_picture
        self._context = context
        self._thread = ThreadPoolExecutor(1, "photographs")
        self._waiting = 0
        self._logged = ""

    async def take(self, by: str) -> TakenPhoto:
        """Take a photograph and return it when it is stored.

        Args:
            by: Name of the client that takes it.

        Raises:
            PhotoError: If it could not be taken or stored; the message is one line.
        """
        if self._waiting >= _MAX_WAITING:
            raise PhotoError("photographs are still being taken: try again later")
        self._waiting += 1
        try:
            picture = await self._next(self._wanted)
            around = self._context
            record = PhotoRecord(
                picture.stamp,
                around.date(),
                picture.frame,
                picture.width,
                picture.height,
                by,
                around.pose_at(picture.stamp),
                around.map_name,
                around.map_sha256,
            )
            name = await self._in_thread(lambda: self._folder.store(picture.data, record))
        except TimeoutError:
            raise PhotoError("the camera gave no picture in time") from None
        except PhotoError as error:
            self._log(str(error))
            raise
        finally:
            self._waiting -= 1
        self._logged = ""
        _LOG.info("%s: photograph %s", by, self._folder.path / name)
        return TakenPhoto(name, picture.stamp)

    async def list(self) -> list[Photo]:
        """Return all photographs.

        Raises:
            PhotoError: If the folder cannot be read.
        """
        return await self._in_thread(self._folder.list)

    async def read(self, name: str) -> bytes | None:
        """Return a photograph or its record by the name of the file; None if there is none.

        Raises:
            PhotoError: If it cannot be read.
        """
        return await self._in_thread(lambda: self._folder.read(name))

    def close(self) -> None:
        """End the thread when it has stored what it was given."""
        self._thread.shutdown(wait=False)

    async def _in_thread(self, work: Callable[[], _T]) -> _T:
        loop = asyncio.get_running_loop()
        doing = loop.run_in_executor(self._thread, work)
        try:
            async with asyncio.timeout(_DISK_TIMEOUT):
                return await asyncio.shield(doing)
        except TimeoutError:
            doing.add_done_callback(lambda done: done.cancelled() or done.exception())
            raise PhotoError(f"the disk of {self._folder.path} does not respond") from None

    def _log(self, reason: str) -> None:
        """Log why a photograph was not stored; once, until one is."""
        if reason != self._logged:
            self._logged = reason
            _LOG.error("no photograph: %s", reason)
