"""The page alone, for a robot that does not serve it."""

from __future__ import annotations

import http.client
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from teleop.console import page_files
from teleop.console.console_server import ConsoleServer
from teleop.errors import SettingError

ROBOT = "ws://192.0.2.7:9090"


@pytest.fixture(autouse=True)
def built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dist = tmp_path / "page/dist"
    dist.mkdir(parents=True)
    (dist / "index.html").write_text("<!doctype html>")
    monkeypatch.setattr(page_files, "files", lambda package: tmp_path)


@contextmanager
def serving() -> Iterator[ConsoleServer]:
    with ConsoleServer(ROBOT, 0) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.05,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


def ask(
    server: ConsoleServer, path: str, method: str = "GET", **headers: str
) -> tuple[int, http.client.HTTPMessage, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    names = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(method, path, headers=names)
    response = connection.getresponse()
    body = response.read()
    connection.close()
    return response.status, response.headers, body


def test_page_names_the_robot_and_may_connect_to_it_only() -> None:
    with serving() as server:
        assert server.server_address[0] == "127.0.0.1"
        status, headers, body = ask(server, "/")
        assert (status, body) == (200, b"<!doctype html>")
        policy = headers["Content-Security-Policy"].split("; ")
        assert f"connect-src 'self' {ROBOT} http://192.0.2.7:9090" in policy
        config = json.loads(ask(server, "/console/config.json")[2])
        assert config["robot"] == ROBOT
        assert ask(server, "/", "HEAD")[2] == b""
        assert ask(server, "/", if_none_match=headers["ETag"])[0] == 304


def test_nothing_else_is_served() -> None:
    with serving() as server:
        for path in ("/map.ply", "/../console_server.py", "/console/%2e%2e/x", "/etc/passwd"):
            assert ask(server, path)[0] == 404
        assert ask(server, "/", "POST")[0] == 501


def test_names_of_other_sites_that_point_here_are_rejected() -> None:
    with serving() as server:
        assert ask(server, "/", host="evil.example:9080")[0] == 403
        assert ask(server, "/", host="localhost:9080")[0] == 200


def test_port_in_use_is_reported_in_one_line() -> None:
    with serving() as server, pytest.raises(SettingError, match=r"port \d+: it is in use"):
        ConsoleServer(ROBOT, server.server_port)
