"""A real browser: local pages use the published clients, foreign pages are rejected."""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import shutil
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest

from teleop.rosbridge import ClientLimits, Protocol, Server
from teleop.rosbridge.compat.standard_services import serve_standard
from teleop.rosbridge.messages.message_types import Message
from tests.teleop.rosbridge.foreign_clients.test_javascript_clients import (
    JAVASCRIPT,
    installed,
    node,
)
from tests.teleop.rosbridge.support import REGISTRY, received_on

pytestmark = pytest.mark.process

PACKAGES = ("roslib@2.1.0", "roslib-old@npm:roslib@1.4.1", "@foxglove/roslibjs@0.0.3")
NAMES = ("chromium", "chromium-browser", "google-chrome")
BROWSER = next((found for name in NAMES if (found := shutil.which(name))), None)
PATIENCE = 90.0
"""Time for a browser to start and three clients to connect on a loaded machine [s]."""

CLOUD = bytes(range(256)) * 400
MAP = b"ply of a map" * 1000
TEXT = "é and 𝄞 in a picture"

browser = pytest.mark.skipif(BROWSER is None, reason="Chromium is not installed")


class Site(SimpleHTTPRequestHandler):
    """Serves the page and its packages, and receives its results."""

    def __init__(self, *args: Any, said: SimpleQueue[Any], **options: Any) -> None:
        self.said = said
        super().__init__(*args, **options)

    def do_POST(self) -> None:
        self.said.put(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *args: object) -> None:
        """Log nothing."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[int, SimpleQueue[Any]]]:
    """Yield the port of a web server and the queue of its pages' results."""
    folder = installed(tmp_path_factory.mktemp("site"), *PACKAGES)
    shutil.copy(JAVASCRIPT / "browser_checks.html", folder / "index.html")
    said: SimpleQueue[Any] = SimpleQueue()
    handler = partial(Site, said=said, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server.server_port, said
        server.shutdown()
        thread.join()


@asynccontextmanager
async def browsing(url: str, profile: Path) -> AsyncIterator[None]:
    """Run a browser that shows a page; other host names also resolve to this machine."""
    assert BROWSER is not None
    headless = [] if BROWSER.endswith("shell") else ["--headless"]
    process = await asyncio.create_subprocess_exec(
        *(BROWSER, *headless, "--no-sandbox", "--disable-gpu", "--no-first-run"),
        *(f"--user-data-dir={profile}", "--host-resolver-rules=MAP foreign.example 127.0.0.1"),
        *("--remote-debugging-port=0", url),
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        yield
    finally:
        os.killpg(process.pid, 9)
        await process.wait()


def visit(site: tuple[int, SimpleQueue[Any]], host: str, folder: Path) -> tuple[Any, list[Message]]:
    """Return the results of a page of a host that connects to a server, and what it published."""
    port, said = site
    protocol = Protocol(REGISTRY, limits=ClientLimits())
    serve_standard(protocol)
    wishes = received_on(protocol, "/joy", "sensor_msgs/Joy")

    async def run() -> Any:
        async with Server(protocol, port=0) as server:
            server.protocol.topics.advertise("/cloud", "sensor_msgs/PointCloud2", latch=True)
            server.protocol.topics.publish("/cloud", {"data": CLOUD}, server.now)
            server.protocol.topics.advertise("/text", "std_msgs/String", latch=True)
            server.protocol.topics.publish("/text", {"data": TEXT}, server.now)
            server.pages.add_file("/map.ply", MAP)
            page = f"http://{host}:{port}/index.html?url=ws://127.0.0.1:{server.port}"
            async with browsing(page, folder / host), asyncio.timeout(PATIENCE):
                return await asyncio.to_thread(said.get, timeout=PATIENCE)

    return asyncio.run(run()), wishes


@pytest.mark.slow
@node
@browser
def test_pages_of_this_machine_use_the_published_clients_unmodified(
    site: tuple[int, SimpleQueue[Any]], tmp_path: Path
) -> None:
    said, wishes = visit(site, "localhost", tmp_path)
    for client in ("roslib2", "roslib1", "foxglove"):
        found = said[client]
        assert isinstance(found, dict), found
        assert (found["kind"], found["size"], found["sum"]) == (
            *("Uint8Array", len(CLOUD)),
            sum(CLOUD),
        )
        assert "/cloud" in found["topics"]
    assert said["roslib2"]["text"] == said["roslib1"]["text"] == TEXT
    data = TEXT.encode() + b"\0"
    assert bytes(said["foxglove"]["raw"]) == b"\0\1\0\0" + len(data).to_bytes(4, "little") + data
    digest = hashlib.sha256(MAP).hexdigest()
    assert said["map"] == {"status": 200, "etag": f'"{digest}"', "hex": digest}
    assert [(wish["axes"].tolist(), wish["buttons"].tolist()) for wish in wishes] == [
        ([0.5], [1])
    ] * 3


@pytest.mark.slow
@node
@browser
def test_foreign_pages_can_neither_drive_nor_subscribe(
    site: tuple[int, SimpleQueue[Any]], tmp_path: Path
) -> None:
    said, wishes = visit(site, "foreign.example", tmp_path)
    assert (said, wishes) == ({"bare": "closed 1006", "peek": "TypeError"}, [])
