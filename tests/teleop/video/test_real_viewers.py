"""Streams and snapshots in programs that are not ours: FFmpeg's libraries, Chromium, and a reader like a headset's."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import av
import pytest
from PIL import Image, ImageChops
from playwright.async_api import Page, async_playwright

from tests.teleop.console.conftest import FLAGS, chromium
from tests.teleop.support import in_a_loop, soon
from tests.teleop.video.support import HEIGHT, TOPIC, WIDTH, get, picture, video
from tests.teleop.video.webrtc.support import emptied, webrtc

STREAM = f"/stream?topic={TOPIC}&type=mjpeg&quality=30"
CHUNK = 4096
"""What a headset reads at once [bytes]."""


def newest_picture(received: bytes) -> bytes | None:
    """Return the last whole picture in what was received, found as a headset finds it.

    It knows neither parts nor lengths: it searches for the first bytes of a JPEG, and for the text of the boundary.
    """
    end = received.rfind(b"\r\n--boundarydonotcross")
    begin = received.rfind(b"\xff\xd8\xff", 0, max(end, 0))
    return received[begin:end] if 0 <= begin < end else None


@in_a_loop
async def test_a_reader_of_chunks_finds_pictures_by_their_first_bytes_and_the_boundary(
    tmp_path: Path,
) -> None:
    async with video(tmp_path) as rig:
        reader, writer = await asyncio.open_connection("127.0.0.1", rig.port)
        writer.write(f"GET {STREAM} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
        shown: list[bytes] = []
        received = b""
        while len(shown) < 5:
            received += await soon(reader.read(CHUNK))
            if (newest := newest_picture(received)) is not None:
                shown.append(newest)
                received = received[received.rfind(b"\r\n--boundarydonotcross") + 2 :]
        writer.close()
        assert {picture(content).size for content in shown} == {(WIDTH, HEIGHT)}
        assert len(set(shown)) == 5


@in_a_loop
async def test_ffmpeg_recognises_the_stream_by_itself(tmp_path: Path) -> None:
    # `ffmpeg -i URL` is the same code.
    def watch(port: int) -> tuple[str, set[tuple[int, int]], int]:
        with av.open(f"http://127.0.0.1:{port}{STREAM}", timeout=20) as stream:
            sizes, seen = set(), 0
            for frame in stream.decode(video=0):
                sizes.add((frame.width, frame.height))
                seen += 1
                if seen == 20:
                    break
            return stream.format.name, sizes, seen

    async with video(tmp_path) as rig:
        found = await soon(asyncio.to_thread(watch, rig.port))
    assert found == ("mpjpeg", {(WIDTH, HEIGHT)}, 20)


@asynccontextmanager
async def browser_page() -> AsyncIterator[Page]:
    """Open a browser in which the name of a foreign page leads to this machine."""
    rules = "--host-resolver-rules=MAP evil.example 127.0.0.1"
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=chromium(), args=[*FLAGS, rules])
        try:
            yield await browser.new_page(viewport={"width": 400, "height": 300})
        finally:
            await browser.close()


@asynccontextmanager
async def foreign_page(body: str) -> AsyncIterator[int]:
    """Serve a page of another origin."""

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(asyncio.IncompleteReadError):
            await reader.readuntil(b"\r\n\r\n")
            head = "HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nConnection: close\r\n\r\n"
            writer.write(f"{head}<!doctype html>{body}".encode())
        writer.close()

    async with await asyncio.start_server(answer, "127.0.0.1", 0) as server:
        yield server.sockets[0].getsockname()[1]


async def shows(page: Page) -> Image.Image:
    """Return what the page's picture shows at the moment."""
    taken = await page.locator("img").screenshot()
    return Image.open(BytesIO(taken)).convert("RGB")


async def image_of(page: Page) -> Any:
    """Return whether the page's picture has come, and its width."""
    return await page.evaluate(
        "() => new Promise(done => { const i = document.images[0];"
        " const say = () => done([i.complete, i.naturalWidth]);"
        " if (i.complete) say(); else { i.onload = say; i.onerror = say; } })"
    )


@pytest.mark.slow
@pytest.mark.process
@in_a_loop
async def test_chromium_shows_the_stream_on_our_page_and_on_no_other(tmp_path: Path) -> None:
    async with video(tmp_path, period=0.1) as rig, browser_page() as page:
        await page.goto(
            f"http://127.0.0.1:{rig.port}/stream_viewer?topic={TOPIC}", wait_until="commit"
        )
        # Not by a function that waits in the page: its policy forbids text to become script.
        width = await page.evaluate(
            "() => new Promise(done => { const look = () => { const i = document.images[0];"
            " i?.naturalWidth ? done(i.naturalWidth) : setTimeout(look, 50); }; look(); })"
        )
        assert width == WIDTH
        first = await shows(page)
        while ImageChops.difference(first, await shows(page)).getbbox() is None:
            rig.show()
        img = f'<img src="http://127.0.0.1:{rig.port}/snapshot?topic={TOPIC}">'
        async with foreign_page(img) as other:
            for host in ("127.0.0.1", "evil.example"):
                await page.goto(f"http://{host}:{other}/", wait_until="commit")
                assert (await image_of(page))[1] == 0, host
        # A name that was pointed at this machine is refused as well.
        refused = await page.goto(f"http://evil.example:{rig.port}/snapshot?topic={TOPIC}")
        assert refused is not None
        assert refused.status == 403
        taken = await page.goto(f"http://127.0.0.1:{rig.port}/snapshot?topic={TOPIC}")
        assert taken is not None
        assert taken.status == 200
        assert (await get(rig.port, "/photos")).json == {"photos": []}


@pytest.mark.slow
@pytest.mark.process
@in_a_loop
async def test_chromium_plays_webrtc_on_our_page_until_it_is_closed(tmp_path: Path) -> None:
    async with webrtc(tmp_path) as (rig, pages), browser_page() as page:
        await page.goto(f"http://127.0.0.1:{rig.port}/webrtc_viewer")
        playing = page.evaluate(
            "() => new Promise(done => { const v = document.querySelector('video');"
            " const look = () => v.currentTime > 0 ? done(v.videoWidth) : setTimeout(look, 50);"
            " look(); })"
        )
        assert await soon(playing) == WIDTH
        assert await page.locator("[role=status]").text_content() == "connected"
        await page.goto("about:blank")
        await soon(emptied(pages))
