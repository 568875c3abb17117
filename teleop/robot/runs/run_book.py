"""The runs of a robot: begun and ended by services, listed and fetched over HTTP."""

from __future__ import annotations

import asyncio
import json
import logging
import re
from collections.abc import AsyncIterator, Callable, Sequence
from http import HTTPStatus
from pathlib import Path
from typing import Any, Final

from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.runs.run_folder import LIST, RunFolder
from teleop.robot.runs.run_interfaces import DELETE, KEEP, START, STATE, STOP
from teleop.robot.runs.run_recorder import RunRecorder
from teleop.rosbridge.server.handled_request import text_page
from teleop.rosbridge.server.http_handlers import HttpRequest, Route, Stream
from teleop.rosbridge.server.http_pages import Page
from teleop.rosbridge.server.server import Server

_PIECE: Final = 256 * 1024
"""What is read from the disk at once [bytes]."""
_LEAST: Final = 10_000_000
"""Least room with which a run is begun [bytes]: a minute of driving."""
_LOG: Final = logging.getLogger(__name__)


class RunBook:
    """Owns the run that is being recorded."""

    def __init__(
        self,
        server: Server,
        folder: Path,
        *,
        space: int,
        stamp: Callable[[], int],
        date: Callable[[], str],
        audit: AuditLog | None,
    ) -> None:
        """Offer services, topic and pages.

        Args:
            server: The robot's server, not yet started.
            folder: Where runs are; made with the first one.
            space: Most that they may take [bytes].
            stamp: Returns the time of the robot's clock [ns].
            date: Returns date and time as ISO 8601.
            audit: Log of what clients do to the robot.
        """
        self._server, self._audit = server, audit
        self._folder = RunFolder(folder, space)
        self._stamp, self._date = stamp, date
        self._recorder: RunRecorder | None = None
        self._name = ""
        self.surfaces: bytes | None = None
        """The map's surfaces, which each run holds."""
        protocol = server.protocol
        protocol.services.serve(START.name, START.type, self._start)
        protocol.services.serve(STOP.name, STOP.type, self._stop)
        protocol.services.serve(DELETE.name, DELETE.type, self._delete)
        protocol.services.serve(KEEP.name, KEEP.type, self._keep)
        protocol.topics.advertise(STATE.name, STATE.type, latch=True)
        self._say("")
        server.handlers.add(LIST, Route(self._list, own_pages_only=True))
        server.handlers.add(f"{LIST}/", Route(self._fetch, own_pages_only=True))

    def close(self) -> None:
        """Complete a run that is being recorded."""
        if self._recorder is not None:
            self._recorder.close()
            self._recorder = None

    def _start(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        if self._recorder is not None:
            return {"success": False, "message": f"{self._name} is being recorded already"}
        name = f"run-{re.sub('[-:]', '', self._date())[:15].replace('T', '-')}.mcap"
        path, loop = self._folder.folder / name, asyncio.get_running_loop()
        room = self._folder.room()
        if room < _LEAST:
            return {"success": False, "message": self._full()}
        if self._folder.find(name) is not None:
            return {"success": False, "message": f"{name} began in this second: begin again"}

        def ended(why: str) -> None:
            loop.call_soon_threadsafe(self._ended, recorder, why)

        def grown() -> None:
            if gone := self._folder.make_room(path):
                loop.call_soon_threadsafe(self._removed, gone)

        try:
            recorder = RunRecorder(
                self._server.protocol,
                path,
                self._stamp,
                self.surfaces,
                ended,
                most=room,
                grown=grown,
            )
        except OSError as error:
            why = f"cannot write {path}: {error.strerror or error}"
            return {"success": False, "message": why}
        self._recorder, self._name = recorder, name
        self._note(client, "record")
        self._say("")
        return {"success": True, "message": name}

    def _stop(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        if self._recorder is None:
            return {"success": False, "message": f"nothing is being recorded; {START.name} begins"}
        self.close()
        self._note(client, "record end")
        self._say("")
        return {"success": True, "message": self._name}

    def _delete(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        return self._change(client, request["name"], "deleted", self._folder.delete)

    def _keep(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        keep = bool(request["keep"])
        done = "kept" if keep else "no longer kept"
        return self._change(
            client, request["name"], done, lambda path: self._folder.keep(path, keep)
        )

    def _change(
        self, client: int, name: str, done: str, change: Callable[[Path], None]
    ) -> dict[str, Any]:
        path = self._folder.find(name)
        if path is None:
            return {"success": False, "message": f"no run {name[:80]!r}: GET {LIST} lists them"}
        if self._recorder is not None and name == self._name:
            words = f"{name} is being recorded; {STOP.name} ends it"
            return {"success": False, "message": words}
        try:
            change(path)
        except OSError as error:
            return {"success": False, "message": f"{path}: {error.strerror or error}"}
        self._note(client, f"run {done}")
        return {"success": True, "message": f"{name} is {done}"}

    def _full(self) -> str:
        space = self._folder.space / 1e9
        return (
            f"the runs that are kept take all of the {space:g} GB that runs may take: "
            f"delete one ({DELETE.name}), keep one no longer ({KEEP.name}), or raise --runs-space"
        )

    def _removed(self, names: list[str]) -> None:
        space = self._folder.space / 1e9
        _LOG.warning(
            "removed %s, the oldest that nobody keeps: runs may take %g GB (--runs-space)",
            ", ".join(names),
            space,
        )
        self._say("", names)

    def _ended(self, recorder: RunRecorder, why: str) -> None:
        if self._recorder is recorder:
            self.close()
            _LOG.error("the run %s ends here: %s; the robot goes on", self._name, why)
            self._say(f"{self._name} ended: {why}")

    def _note(self, client: int, what: str) -> None:
        if self._audit is not None:
            self._audit.action(self._server.protocol.connections.name(client), what)

    def _say(self, ended: str, removed: Sequence[str] = ()) -> None:
        recording = self._name if self._recorder else ""
        state = {"recording": recording, "ended": ended, "removed": list(removed)}
        self._server.protocol.topics.publish(
            STATE.name, {"data": json.dumps(state)}, self._server.now
        )

    async def _list(self, request: HttpRequest) -> Page:
        present = self._name if self._recorder else ""
        runs = await asyncio.to_thread(self._folder.facts, present)
        headers = {"Content-Type": "application/json", "Cache-Control": "no-store"}
        return Page(HTTPStatus.OK, headers, json.dumps({"runs": runs}).encode())

    async def _fetch(self, request: HttpRequest) -> Page | Stream:
        name = request.path.removeprefix(f"{LIST}/")
        path = self._folder.find(name)
        if path is None:
            line = f"no run {name[:80]!r}: GET {LIST} lists them"
            return text_page(HTTPStatus.NOT_FOUND, line)
        headers = {
            "Content-Type": "application/octet-stream",
            "Content-Disposition": f'attachment; filename="{name}"',
            "Cache-Control": "no-cache",
        }
        return Stream(headers, _pieces(path))


async def _pieces(path: Path) -> AsyncIterator[bytes]:
    with path.open("rb") as file:
        while piece := await asyncio.to_thread(file.read, _PIECE):
            yield piece
