"""HTTP server of the console page alone, on loopback, for a robot that does not serve the page itself."""

from __future__ import annotations

import errno
import logging
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Final

from teleop.console.page_files import offer_page
from teleop.errors import SettingError
from teleop.rosbridge.auth.origins import Origins
from teleop.rosbridge.server.http_pages import HttpPages, Page

_HOST: Final = "127.0.0.1"
_TIMEOUT: Final = 10.0
"""Time for a request, and for a piece of the response to be taken [s]."""
_LOG: Final = logging.getLogger(__name__)


class ConsoleServer(ThreadingHTTPServer):
    """Serves the page with a configuration that names one robot; nothing else is served."""

    daemon_threads = True

    def __init__(self, robot: str, port: int) -> None:
        """Listen; requests are answered while ``serve_forever`` runs.

        Args:
            robot: Address of the robot, ``ws://HOST:PORT``.
            port: Port to listen on; 0 takes a free one.

        Raises:
            SettingError: If the port is not available.
        """
        self.pages = HttpPages(lambda: 0)
        self.built = offer_page(self.pages, robot=robot)
        """Whether there is a page, and not only a line that says how to build it."""
        self.origins = Origins(_HOST)
        try:
            super().__init__((_HOST, port), _Handler)
        except OSError as error:
            why = error.strerror
            if error.errno == errno.EADDRINUSE:
                why = "it is in use; choose another one (0: any)"
            raise SettingError(f"cannot listen on port {port}: {why}") from None

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{_HOST}:{self.server_port}/"


class _Handler(BaseHTTPRequestHandler):
    server: ConsoleServer
    timeout = _TIMEOUT

    def do_GET(self) -> None:
        """Send a file of the page."""
        self._send(self._page())

    def do_HEAD(self) -> None:
        """Send the headers of a file."""
        self._send(self._page())

    def _page(self) -> Page:
        # Another site's name may point to this machine, and then reads the page as if it were its own.
        if not self.server.origins.allow_host(self.headers.get("Host", "")):
            return Page(HTTPStatus.FORBIDDEN)
        request = {name.title(): value for name, value in self.headers.items()}
        found = self.server.pages.respond(self.command, self.path, request)
        return found or Page(HTTPStatus.NOT_FOUND)

    def _send(self, page: Page) -> None:
        self.send_response(page.status)
        headers = page.headers
        if not page.headers:
            headers = {"Content-Length": "0"}
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(page.body)

    def log_message(self, format: str, *args: Any) -> None:
        """Log requests for those who want to see everything."""
        _LOG.debug(format, *args)
