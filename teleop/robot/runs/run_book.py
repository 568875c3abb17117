"""The runs of a robot: begun and ended by services, listed and fetched over HTTP."""

from __future__ import annotations

import asyncio
import json
import logging
import re
from collections.abc import AsyncIterator, Callable
from http import HTTPStatus
from pathlib import Path
from typing import Any, Final

from mcap.exceptions import McapError
from mcap.reader import make_reader

from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.runs.run_interfaces import START, STATE, STOP
from teleop.robot.runs.run_recorder import RunRecorder
from teleop.rosbridge.server.handled_request import text_page
from teleop.rosbridge.server.http_handlers import HttpRequest, Route, Stream
from teleop.rosbridge.server.http_pages import Page
from teleop.rosbridge.server.server import Server

LIST: Final = "/runs"
"""Path of the list; a run is below it."""

_NAME: Final = re.compile(r"run-\d{8}-\d{6}\.mcap")
_PIECE: Final = 256 * 1024
"""What is read from the disk at once [bytes]."""
_MOST_LISTED: Final = 200
_LOG: Final = logging.getLogger(__name__)


class RunBook:
    """Owns the run that is being recorded."""

    def __init__(
        self,
        server: Server,
        folder: Path,
        *,
        stamp: Callable[[], int],
        date: Callable[[], str],
        audit: AuditLog | None,
    ) -> None:
        """Offer services, topic and pages.

        Args:
            server: The robot's server, not yet started.
            folder: Where runs are kept; made with the first one.
            stamp: Returns the time of the robot's clock [ns].
            date: Returns date and time as ISO 8601.
            audit: Log of what clients do to the robot.
        """
        self._server, self._folder, self._audit = server, folder, audit
        self._stamp, self._date = stamp, date
        self._recorder: RunRecorder | None = None
        self._name = ""
        self.surfaces: bytes | None = None
        """The map's surfaces, which each run holds."""
        protocol = server.protocol
        protocol.services.serve(START.name, START.type, self._start)
        protocol.services.serve(STOP.name, STOP.type, self._stop)
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
        loop = asyncio.get_running_loop()

        def ended(why: str) -> None:
            loop.call_soon_threadsafe(self._ended, recorder, why)

        try:
            recorder = RunRecorder(
                self._server.protocol, self._folder / name, self._stamp, self.surfaces, ended
            )
        except OSError as error:
            why = f"cannot write {self._folder / name}: {error.strerror or error}"
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

    def _ended(self, recorder: RunRecorder, why: str) -> None:
        if self._recorder is recorder:
            self.close()
            _LOG.error("the run %s ends here: %s; the robot goes on", self._name, why)
            self._say(f"{self._name} ended: {why}")

    def _note(self, client: int, what: str) -> None:
        if self._audit is not None:
            self._audit.action(self._server.protocol.connections.name(client), what)

    def _say(self, ended: str) -> None:
        state = {"recording": self._name if self._recorder else "", "ended": ended}
        self._server.protocol.topics.publish(
            STATE.name, {"data": json.dumps(state)}, self._server.now
        )

    async def _list(self, request: HttpRequest) -> Page:
        runs = await asyncio.to_thread(self._runs)
        headers = {"Content-Type": "application/json", "Cache-Control": "no-store"}
        return Page(HTTPStatus.OK, headers, json.dumps({"runs": runs}).encode())

    def _runs(self) -> list[dict[str, Any]]:
        """Return the newest runs first, without the one that is being recorded."""
        present = self._name if self._recorder else ""
        found = [p for p in self._folder.glob("run-*.mcap") if _NAME.fullmatch(p.name)]
        names = sorted((p.name for p in found if p.name != present), reverse=True)
        return [self._run(name) for name in names[:_MOST_LISTED]]

    def _run(self, name: str) -> dict[str, Any]:
        path, seconds = self._folder / name, None
        try:
            with path.open("rb") as file:
                summary = make_reader(file).get_summary()
            if summary is not None and (all_of := summary.statistics) is not None:
                seconds = (all_of.message_end_time - all_of.message_start_time) / 1e9
        except (McapError, OSError):
            pass  # it has no end, since the disk was full: its length is not known
        return {
            "name": name,
            "url": f"{LIST}/{name}",
            "start": f"{name[4:8]}-{name[8:10]}-{name[10:12]}T{name[13:15]}:{name[15:17]}:{name[17:19]}Z",
            "seconds": seconds,
            "bytes": path.stat().st_size if path.exists() else 0,
        }

    async def _fetch(self, request: HttpRequest) -> Page | Stream:
        name = request.path.removeprefix(f"{LIST}/")
        path = self._folder / name
        if not _NAME.fullmatch(name) or not path.is_file():
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
