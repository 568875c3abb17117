"""Pictures by WebRTC: answers to offers, who gets them, and what is bound for them."""

from __future__ import annotations

import asyncio
import contextlib
import re
import subprocess
import sys
from pathlib import Path

import pytest
from aiortc.mediastreams import MediaStreamError

from teleop.pictures.picture import PictureFormat
from teleop.video.webrtc.webrtc_pages import MAX_PEERS, VIEWER
from tests.teleop.support import in_a_loop
from tests.teleop.video.support import HEIGHT, WIDTH, get, video
from tests.teleop.video.webrtc.support import (
    WebrtcViewer,
    emptied,
    frame_of,
    post,
    udp_addresses,
    watching,
    webrtc,
)

LOOPBACK = "0100007F"
"""127.0.0.1 as the kernel writes it."""


@in_a_loop
async def test_a_viewer_sees_the_camera_and_nothing_beyond_loopback_is_bound(
    tmp_path: Path,
) -> None:
    async with webrtc(tmp_path) as (rig, pages):
        before = udp_addresses()
        async with watching(rig.port) as (_, track):
            first, second = await frame_of(track), await frame_of(track)
            assert (first.width, first.height) == (WIDTH, HEIGHT)
            assert first.pts is not None
            assert second.pts is not None
            assert second.pts > first.pts
            assert udp_addresses() - before == {LOOPBACK}
            assert rig.hub.wanted == {PictureFormat("/camera/rgb/image_raw", "rgb8", WIDTH, HEIGHT)}
        await emptied(pages)
        assert not rig.hub.wanted
        assert udp_addresses() == before


@in_a_loop
async def test_the_answer_names_no_address_but_the_servers_and_no_ice_server_is_asked(
    tmp_path: Path,
) -> None:
    async with webrtc(tmp_path) as (rig, _):
        viewer = WebrtcViewer()
        answer = (await post(rig.port, await viewer.offer())).body.decode()
        await viewer.connection.close()
        candidates = re.findall(r"^a=candidate:.*$", answer, re.MULTILINE)
        assert candidates
        assert all(" 127.0.0.1 " in line and "typ host" in line for line in candidates)


@in_a_loop
async def test_an_address_that_an_offer_names_gets_no_packet(tmp_path: Path) -> None:
    class Bystander(asyncio.DatagramProtocol):
        def __init__(self) -> None:
            self.received: list[bytes] = []

        def datagram_received(self, data: bytes, addr: object) -> None:
            self.received.append(data)

    async with webrtc(tmp_path) as (rig, _):
        loop = asyncio.get_running_loop()
        transport, bystander = await loop.create_datagram_endpoint(
            Bystander, local_addr=("127.0.0.1", 0)
        )
        port = transport.get_extra_info("sockname")[1]
        viewer = WebrtcViewer()
        offer = re.sub(r"127\.0\.0\.1 \d+ typ", f"127.0.0.1 {port} typ", await viewer.offer())
        named = offer + f"a=candidate:7 1 udp 1 made-up-name.local {port} typ host\r\n"
        assert f"127.0.0.1 {port} typ host" in named
        answer = await post(rig.port, named)
        track = await viewer.accept(answer.body.decode())
        await frame_of(track)
        assert not bystander.received
        await viewer.connection.close()
        transport.close()


@in_a_loop
async def test_a_viewer_beyond_the_most_is_refused_until_one_leaves(tmp_path: Path) -> None:
    async with webrtc(tmp_path) as (rig, pages):
        viewers = [WebrtcViewer() for _ in range(MAX_PEERS + 1)]
        answers = [await post(rig.port, await each.offer()) for each in viewers]
        assert [answer.status for answer in answers] == [200] * MAX_PEERS + [503]
        assert answers[-1].line == "4 viewers watch by WebRTC already: /stream has room for more"
        await pages.close()
        assert pages.peers == 0
        again = WebrtcViewer()
        assert (await post(rig.port, await again.offer())).status == 200
        for viewer in (*viewers, again):
            await viewer.connection.close()


@pytest.mark.slow
@in_a_loop
async def test_tokens_and_tickets_admit_and_a_withdrawn_token_ends_the_connection(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with webrtc(tmp_path, tokens=True) as (rig, pages):
        viewer = WebrtcViewer()
        offer = await viewer.offer()
        await viewer.connection.close()
        refused = await post(rig.port, offer)
        assert refused.status == 401
        assert "a token is required" in refused.line
        bearer = {"Authorization": "Bearer view-view-view-view"}
        ticket = (await get(rig.port, "/video_ticket", "POST", **bearer)).json["ticket"]
        page = await get(rig.port, f"{VIEWER}?ticket={ticket}")
        assert page.status == 200
        async with watching(rig.port, f"?ticket={ticket}") as (_, track):
            await frame_of(track)
            monkeypatch.setattr(rig.access, "still", lambda access: False)
            with contextlib.suppress(MediaStreamError):
                while True:
                    await frame_of(track)
            await emptied(pages)


@in_a_loop
async def test_offers_that_are_none_are_refused_in_one_line(tmp_path: Path) -> None:
    async with webrtc(tmp_path) as (rig, pages):
        sound = WebrtcViewer()
        audio = await sound.offer(kind="audio")
        await sound.connection.close()
        for offer, status, line in (
            ("", 400, "this one has: none"),
            ("v=0\r\nm=video", 400, "the offer is not understood"),
            (b"\xff\xfe", 400, "an offer is UTF-8"),
            (audio, 400, "this one has: audio"),
            ("m=video 9\r\n" * 3, 400, "this one has: video, video, video"),
        ):
            answer = await post(rig.port, offer)
            assert (answer.status, answer.body.count(b"\n")) == (status, 1), answer.line
            assert line in answer.line
        wrong = await post(rig.port, "v=0", Content_Type="application/json")
        assert wrong.status == 415
        depth = await post(rig.port, "v=0", "?topic=/camera/depth/image_raw")
        assert depth.status == 404
        assert "/camera/rgb/image_rect_color, /camera/rgb/image_raw" in depth.line
        assert pages.peers == 0
        assert not rig.hub.wanted


@in_a_loop
async def test_pages_of_other_origins_get_no_answer(tmp_path: Path) -> None:
    async with webrtc(tmp_path) as (rig, _):
        for path in ("/webrtc/offer", VIEWER, "/webrtc_viewer.js"):
            method = "POST" if path == "/webrtc/offer" else "GET"
            answer = await get(rig.port, path, method, Sec_Fetch_Site="cross-site")
            assert answer.status == 403
            assert answer.headers.get("access-control-allow-origin") is None


@in_a_loop
async def test_the_page_runs_its_own_script_alone(tmp_path: Path) -> None:
    async with webrtc(tmp_path) as (rig, _):
        page = await get(rig.port, VIEWER)
        policy = page.headers["content-security-policy"]
        assert "default-src 'none'; script-src 'self'; connect-src 'self'" in policy
        assert b'<script src="/webrtc_viewer.js" defer></script>' in page.body
        script = await get(rig.port, "/webrtc_viewer.js")
        assert script.headers["content-type"].startswith("text/javascript")
        assert b"iceServers" not in script.body


@in_a_loop
async def test_without_it_there_is_no_such_page(tmp_path: Path) -> None:
    async with video(tmp_path, filming=False) as rig:
        assert (await post(rig.port, "v=0")).status in (400, 404)
        assert (await get(rig.port, VIEWER)).status == 404


@pytest.mark.process
def test_nothing_of_it_is_loaded_with_the_robots_video() -> None:
    code = "import sys, teleop.robot.video.robot_video; print({'aiortc', 'av'} & set(sys.modules))"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout == "set()\n"
