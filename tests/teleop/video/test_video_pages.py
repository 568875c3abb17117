"""Streams, snapshots, viewer and list, over real sockets."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from pathlib import Path

import pytest

from teleop.pictures.picture import PictureFormat
from teleop.video import video_pages
from tests.teleop.rosbridge.server.test_server import until
from tests.teleop.support import in_a_loop, soon
from tests.teleop.video.support import (
    HEIGHT,
    PERIOD,
    TOPIC,
    WIDTH,
    further_port,
    get,
    picture,
    video,
    viewer,
)

STREAM = f"/stream?topic={TOPIC}&type=mjpeg&quality=30"
"""As the glasses of the thesis ask for it."""


def light(content: bytes, pixel: tuple[int, int]) -> bool:
    """Return whether a pixel is light."""
    grey = picture(content).convert("L").getpixel(pixel)
    return isinstance(grey, int) and grey > 200


@in_a_loop
async def test_a_stream_has_the_form_of_web_video_server(tmp_path: Path) -> None:
    async with video(tmp_path) as rig, viewer(rig.port, STREAM) as watching:
        assert watching.status == 200
        kind = "multipart/x-mixed-replace;boundary=boundarydonotcross"
        assert watching.headers["content-type"] == kind
        assert watching.headers["cross-origin-resource-policy"] == "same-origin"
        assert "access-control-allow-origin" not in watching.headers
        parts = [await soon(watching.next()) for _ in range(5)]
        for part in parts:
            assert part.headers["content-type"] == "image/jpeg"
            assert len(part.headers["x-timestamp"].partition(".")[2]) == 9
            assert picture(part.data).size == (WIDTH, HEIGHT)
        stamps = [part.stamp for part in parts]
        assert stamps == sorted(set(stamps))
        assert rig.hub.wanted == {PictureFormat("/camera/rgb/image_raw", "jpeg", WIDTH, HEIGHT, 30)}
        watching.close()
        await soon(until(lambda: not rig.hub.wanted))


@in_a_loop
async def test_the_boundary_follows_each_picture_at_once(tmp_path: Path) -> None:
    # Readers that wait for it would otherwise show each picture when the next one comes.
    async with (
        video(tmp_path, filming=False) as rig,
        viewer(rig.port, STREAM) as watching,
    ):
        await watching.reader.readuntil(b"--boundarydonotcross\r\n")
        rig.show()
        await soon(watching.reader.readuntil(b"\r\n--boundarydonotcross\r\n"))


@in_a_loop
async def test_a_stream_of_a_lower_rate_has_nothing_drawn_between_its_pictures(
    tmp_path: Path,
) -> None:
    async with video(tmp_path) as rig, viewer(rig.port, f"{STREAM}&rate=5") as watching:
        await watching.reader.readuntil(b"--boundarydonotcross\r\n")
        begun = asyncio.get_running_loop().time()
        for _ in range(3):
            await soon(watching.reader.readuntil(b"\r\n--boundarydonotcross\r\n"))
            await soon(until(lambda: not rig.hub.wanted))
            await soon(until(lambda: bool(rig.hub.wanted)))
        assert asyncio.get_running_loop().time() - begun > 0.55
    await soon(until(lambda: not rig.hub.wanted))


@in_a_loop
async def test_size_quality_and_invert_are_those_of_the_address(tmp_path: Path) -> None:
    async with video(tmp_path) as rig:
        address = f"/snapshot?topic={TOPIC[1:]}&width=80&height=40&quality=10&invert"
        small = await get(rig.port, address)
        assert picture(small.body).size == (80, 40)
        assert light(small.body, (79, 39))  # the bar's beginning
        large = await get(rig.port, f"/snapshot?topic={TOPIC}")
        assert picture(large.body).size == (WIDTH, HEIGHT)
        assert light(large.body, (0, 0))
        assert len(large.body) > 2 * len(small.body)
        assert rig.encoded[-1].quality == 95


REFUSED = [
    ("", 400, f"topic is missing: /stream?topic={TOPIC}; there are {TOPIC}, "),
    ("topic=/odom", 404, f"no pictures of topic '/odom': there are {TOPIC}, "),
    (f"topic={TOPIC}&type=vp8", 415, "type 'vp8' is not served here; type=mjpeg works"),
    (f"topic={TOPIC}&quality=0", 400, "quality must be 1 to 100, got '0'"),
    (f"topic={TOPIC}&quality=good", 400, "quality must be 1 to 100, got 'good'"),
    (f"topic={TOPIC}&rate=61", 400, "rate must be 1 to 60, got '61'"),
    (f"topic={TOPIC}&width=161", 400, "width must be 1 to 160, got '161'"),
    (f"topic={TOPIC}&height={10**30}", 400, "height must be 1 to 120, got '1000"),
]


@in_a_loop
async def test_what_is_not_there_is_refused_in_one_line(tmp_path: Path) -> None:
    async with video(tmp_path) as rig:
        for query, status, line in REFUSED:
            answer = await get(rig.port, f"/stream?{query}")
            assert (answer.status, answer.line.startswith(line)) == (status, True), answer.line
            assert answer.body.count(b"\n") == 1
            assert not rig.hub.wanted


@in_a_loop
async def test_a_snapshot_is_never_a_picture_from_before_the_request(tmp_path: Path) -> None:
    async with video(tmp_path, filming=False) as rig:
        asked = asyncio.create_task(get(rig.port, f"/snapshot?topic={TOPIC}"))
        await soon(until(lambda: bool(rig.hub.wanted)))
        before = rig.stamp
        rig.show(late=2 * PERIOD)
        await asyncio.sleep(0.05)
        assert not asked.done()
        rig.show()
        answer = await soon(asked)
        assert answer.headers["content-type"] == "image/jpeg"
        assert float(answer.headers["x-timestamp"]) > before / 1e9
        assert answer.headers["cache-control"].startswith("no-cache, no-store")


@in_a_loop
async def test_a_snapshot_without_a_camera_that_sees_is_answered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(video_pages, "SNAPSHOT_TIMEOUT", 0.1)
    async with video(tmp_path, filming=False) as rig:
        answer = await get(rig.port, f"/snapshot?topic={TOPIC}")
        assert (answer.status, answer.line.startswith("no picture came within")) == (504, True)
        assert not rig.hub.wanted


@in_a_loop
async def test_viewer_and_list_lead_to_the_streams(tmp_path: Path) -> None:
    async with video(tmp_path) as rig, further_port(rig) as port:
        page = await get(rig.port, f"/stream_viewer?topic={TOPIC}&quality=50")
        assert page.headers["content-type"] == "text/html; charset=utf-8"
        assert "script-src" not in page.headers["content-security-policy"]
        assert f'<img src="/stream?topic={TOPIC}&amp;quality=50"' in page.line
        for number, path in ((rig.port, "/streams"), (port, "/")):
            listed = await get(number, path)
            assert f'<a href="/stream_viewer?topic={TOPIC}">{TOPIC}</a>' in listed.line
            assert '<a href="/snapshot?topic=/camera/depth/image_raw">' in listed.line
        evil = await get(rig.port, "/stream_viewer?topic=/camera/rgb/image_raw&quality=%22")
        assert evil.status == 400
        async with viewer(port, STREAM) as watching:
            assert picture((await soon(watching.next())).data).size == (WIDTH, HEIGHT)


@in_a_loop
async def test_a_viewer_that_stalls_costs_the_others_nothing_and_gets_the_newest_again(
    tmp_path: Path,
) -> None:
    async with video(tmp_path, filming=False) as rig:
        rig.padding = 60_000
        async with (
            viewer(rig.port, STREAM, buffer=65_536) as stalled,
            viewer(rig.port, STREAM, buffer=65_536) as watching,
        ):
            seen = []
            for _ in range(60):
                rig.show()
                seen.append((await soon(watching.next())).stamp)
            assert len(set(seen)) == 60
            got = [(await soon(stalled.next())).stamp]
            while got[-1] < seen[-1]:
                got.append((await soon(stalled.next())).stamp)
            # The kernel's buffers held a few old ones; then the newest came.
            assert len(got) < 15
            assert got[-1] == seen[-1]
            assert got == sorted(got)


@in_a_loop
async def test_at_most_four_sizes_and_qualities_are_encoded_each_once(tmp_path: Path) -> None:
    async with video(tmp_path) as rig, AsyncExitStack() as stack:
        for quality in (20, 30, 40, 50, 50, 30):
            address = f"/stream?topic={TOPIC}&quality={quality}"
            await stack.enter_async_context(viewer(rig.port, address))
        assert {wanted.quality for wanted in rig.hub.wanted} == {20, 30, 40, 50}
        refused = await get(rig.port, f"/stream?topic={TOPIC}&quality=60")
        assert refused.status == 503
        assert "4 sizes and qualities are watched already, ask for one of these" in refused.line
        assert "quality=20&width=160&height=120" in refused.line
        # Raw and rectified colours are the same pictures.
        same = await stack.enter_async_context(
            viewer(rig.port, "/stream?topic=/camera/rgb/image_raw&quality=20")
        )
        assert same.status == 200
        rig.encoded.clear()
        rig.show()
        assert len(rig.encoded) == 4
        assert (await get(rig.port, f"/snapshot?topic={TOPIC}&quality=50")).status == 200


@in_a_loop
async def test_viewers_of_an_address_are_limited_and_make_room_when_they_leave(
    tmp_path: Path,
) -> None:
    async with video(tmp_path) as rig, AsyncExitStack() as stack:
        watching = [await stack.enter_async_context(viewer(rig.port, STREAM)) for _ in range(10)]
        refused = await get(rig.port, STREAM)
        assert (refused.status, refused.line) == (
            429,
            "10 viewers of this address watch already: close one",
        )
        watching[0].close()
        for _ in range(100):
            answer = await get(rig.port, f"/snapshot?topic={TOPIC}&quality=30")
            if answer.status == 200:
                return
        pytest.fail(answer.line)


@in_a_loop
async def test_pages_of_other_origins_get_no_pictures(tmp_path: Path) -> None:
    headers: dict[str, str]
    async with video(tmp_path) as rig:
        for headers in (
            {"sec_fetch_site": "cross-site"},
            {"sec_fetch_site": "same-site"},
            {"origin": "http://localhost:8000"},
            {"host": "evil.example:9090"},
        ):
            for path in (f"/snapshot?topic={TOPIC}", "/streams", "/photos"):
                answer = await get(rig.port, path, **headers)
                assert answer.status == 403, headers
                assert "access-control-allow-origin" not in answer.headers
            assert (await get(rig.port, "/photos", "POST", **headers)).status == 403
            assert not rig.hub.wanted
