"""Files of the page, and their security headers."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from teleop.console import page_files
from teleop.console.page_files import MISSING, offer_page, security_headers
from teleop.rosbridge.server.http_pages import HttpPages, Page


@pytest.fixture
def built(tmp_path: Path) -> Path:
    """A built page, with files that are not for browsers."""
    for name, text in {
        "index.html": "<!doctype html>",
        "console.js": "start()",
        "style.css": "p {}" * 100,
        "icons/stop.svg": "<svg/>",
        ".sources": "a hash",
        "console.ts": "not built",
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def get(pages: HttpPages, path: str, host: str = "127.0.0.1:9090") -> Page:
    page = pages.respond("GET", path, {"Host": host})
    assert page is not None
    return page


def test_page_is_at_the_root_and_its_files_below_console(built: Path) -> None:
    pages = HttpPages(lambda: 0)
    assert offer_page(pages, page=built)
    assert get(pages, "/").body == b"<!doctype html>"
    for path, kind in {
        "/": "text/html; charset=utf-8",
        "/console/console.js": "text/javascript; charset=utf-8",
        "/console/style.css": "text/css; charset=utf-8",
        "/console/icons/stop.svg": "image/svg+xml",
        "/console/config.json": "application/json",
    }.items():
        assert get(pages, path).headers["Content-Type"] == kind
        assert pages.is_public(path)
    for path in ("/console/.sources", "/console/console.ts", "/console/index.html", "/console/"):
        assert pages.respond("GET", path, {}) is None


@pytest.mark.parametrize(
    ("robot", "encrypted", "host", "sources"),
    [
        ("", False, "127.0.0.1:9090", "'self' ws://127.0.0.1:9090"),
        ("", True, "192.168.1.7:9090", "'self' wss://192.168.1.7:9090"),
        ("", False, "x; script-src *", "'self'"),
        ("ws://robot:9090", False, "127.0.0.1:9080", "'self' ws://robot:9090 http://robot:9090"),
        ("wss://robot:9090", False, "127.0.0.1:1", "'self' wss://robot:9090 https://robot:9090"),
    ],
)
def test_policy_names_the_one_robot_that_the_page_connects_to(
    robot: str, encrypted: bool, host: str, sources: str, built: Path
) -> None:
    pages = HttpPages(lambda: 0)
    offer_page(pages, robot=robot, encrypted=encrypted, page=built)
    page = get(pages, "/", host)
    policy = page.headers["Content-Security-Policy"].split("; ")
    assert f"connect-src {sources}" in policy
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert not any("unsafe" in part or "*" in part for part in policy)
    assert json.loads(get(pages, "/console/config.json").body)["robot"] == robot


def test_every_file_has_the_security_headers_also_when_it_is_known(built: Path) -> None:
    pages = HttpPages(lambda: 0)
    offer_page(pages, page=built)
    for path in ("/", "/console/console.js", "/console/config.json"):
        page = get(pages, path)
        known = pages.respond("GET", path, {"If-None-Match": page.headers["ETag"]})
        assert known is not None
        assert known.status == 304
        for found in (page, known):
            assert set(security_headers("'self'")) <= set(found.headers)
            assert found.headers["X-Content-Type-Options"] == "nosniff"
            assert found.headers["Referrer-Policy"] == "no-referrer"
            assert found.headers["Permissions-Policy"] == "gamepad=(self)"


def test_without_a_built_page_the_root_says_how_to_build_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_files, "files", lambda package: tmp_path)
    pages = HttpPages(lambda: 0)
    assert not offer_page(pages)
    page = get(pages, "/")
    assert (page.status, page.body.decode()) == (200, f"{MISSING}\n")
    assert page.headers["Content-Type"] == "text/plain; charset=utf-8"
    assert pages.respond("GET", "/console/config.json", {}) is None
