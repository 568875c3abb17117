"""Hands each picture to those who asked for its format; the newest counts, and what nobody wants is never made."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from teleop.pictures.picture import Picture, PictureFormat


class Watch:
    """One viewer's wish for one format; a slow viewer skips pictures."""

    def __init__(
        self,
        hub: PictureHub,
        wanted: PictureFormat,
        take: Callable[[Picture], object] | None = None,
    ) -> None:
        """Watch a hub's pictures; `PictureHub.watch` makes one."""
        self._hub, self.format, self._take = hub, wanted, take
        self._newest: Picture | None = None
        self._arrived = asyncio.Event()
        self._closed = False

    async def next(self) -> Picture:
        """Wait for a picture that this viewer has not had, and return the newest."""
        await self._arrived.wait()
        self._arrived.clear()
        assert self._newest is not None
        return self._newest

    def offer(self, picture: Picture) -> None:
        """Hand a picture over, or replace the one that waits for the viewer."""
        if self._take is not None:
            self._take(picture)
            return
        self._newest = picture
        self._arrived.set()

    def rest(self) -> None:
        """Watch nothing until ``resume``; what waits is dropped."""
        self._hub.drop(self)
        self._arrived.clear()

    def resume(self) -> None:
        """Watch again after a rest, unless it was closed in it."""
        if not self._closed:
            self._hub.add(self)

    def close(self) -> None:
        """Stop watching."""
        self._closed = True
        self._hub.drop(self)


class PictureHub:
    """All viewers of all pictures of one robot; belongs to one event loop."""

    def __init__(self, wanted_changed: Callable[[frozenset[PictureFormat]], object]) -> None:
        """Begin without viewers.

        Args:
            wanted_changed: Called with all wanted formats whenever they change, so that only those are made.
        """
        self._wanted_changed = wanted_changed
        self._watches: dict[PictureFormat, list[Watch]] = {}

    @property
    def wanted(self) -> frozenset[PictureFormat]:
        """The formats that somebody watches."""
        return frozenset(self._watches)

    def watch(
        self, wanted: PictureFormat, take: Callable[[Picture], object] | None = None
    ) -> Watch:
        """Begin to watch a format; close the watch when the viewer leaves.

        Args:
            wanted: The format.
            take: Called at once with each picture, for a viewer that never waits; otherwise await ``next``.
        """
        watch = Watch(self, wanted, take)
        self.add(watch)
        return watch

    def add(self, watch: Watch) -> None:
        """Offer a watch pictures from now on."""
        new = watch.format not in self._watches
        self._watches.setdefault(watch.format, []).append(watch)
        if new:
            self._wanted_changed(self.wanted)

    def drop(self, watch: Watch) -> None:
        """Forget a watch."""
        watches = self._watches.get(watch.format, [])
        if watch in watches:
            watches.remove(watch)
            if not watches:
                del self._watches[watch.format]
                self._wanted_changed(self.wanted)

    def publish(self, picture: Picture) -> None:
        """Offer a picture to those that watch its format."""
        for watch in tuple(self._watches.get(picture.format, ())):
            watch.offer(picture)
