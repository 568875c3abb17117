"""Streams and photographs of a robot whose camera is drawn, over real sockets."""

from __future__ import annotations

import asyncio
import contextlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.errors import SettingError
from teleop.robot.serving.serve_config import ServeConfig
from tests.teleop.robot.served_robots import DRIVER, VIEWER, Serving, audited, served, signed_in
from tests.teleop.support import in_a_loop, peer, soon
from tests.teleop.video.support import get, picture, viewer
from tests.teleop.video.webrtc.support import frame_of, watching as watching_by_webrtc

COLOURS = "/camera/rgb/image_rect_color"


@pytest.mark.slow
@in_a_loop
async def test_a_robot_in_lockstep_shows_what_it_sees_and_photographs_it(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    config = ServeConfig(
        camera="small",
        video_port=0,
        webrtc=True,
        photos=tmp_path / "photos",
    )
    async with (
        served(office, office_cloud, cache, config) as address,
        peer(address.url) as driver,
    ):
        await driver.send(op="subscribe", topic="/cam_sources")
        await driver.until(lambda: driver.received, "the list")
        sources = json.loads(driver.received[0]["msg"]["data"])
        assert list(sources) == ["p3at", "p3at_depth"]
        base, _, query = sources["p3at"].partition("/stream?")
        assert query == f"topic={COLOURS}&type=mjpeg&quality=30"
        assert address.streams == f"{base}/streams"
        further = int(base.rpartition(":")[2])
        assert further != address.port

        async def stepping() -> None:
            while True:
                await driver.step(5)

        async with viewer(further, f"/stream?{query}") as watching:
            steps = asyncio.create_task(stepping())
            parts = [await soon(watching.next()) for _ in range(3)]
            depth = await get(address.port, "/snapshot?topic=/camera/depth/image_raw")
            turned = await get(address.port, f"/snapshot?topic={COLOURS}&quality=30&invert")
            taken = (await get(address.port, "/photos", "POST")).json
            async with watching_by_webrtc(address.port) as (_, track):
                assert (await frame_of(track)).width == picture(parts[0].data).width
            steps.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await steps
        whole = picture(parts[-1].data)
        assert picture(depth.body).mode == "L"
        upright, inverted = np.asarray(whole.convert("L")), picture(turned.body).convert("L")
        difference = np.abs(upright - np.asarray(inverted, float)[::-1, ::-1])
        assert difference.mean() < 3.0
        photo = await get(address.port, taken["url"])
        assert picture(photo.body).size == whole.size
        record = (await get(address.port, "/photos/photo0.json")).json
        assert record["map_sha256"] == office_cloud.sha256
        assert abs(record["pose"]["stamp"] - taken["stamp"]) <= 20_000_000
        assert (tmp_path / "photos" / "photo0.jpg").read_bytes() == photo.body


@pytest.mark.slow
@in_a_loop
async def test_photographs_and_who_was_refused_pictures_are_in_the_audit_log(
    serving: Serving, tmp_path: Path
) -> None:
    settings = {"name": "rover-7", "camera": "small", "photos": tmp_path / "photos"}
    async with signed_in(serving, tmp_path, DRIVER, **settings) as (address, (driver,)):
        announced: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        await driver.subscribe("/cam_sources", "std_msgs/String", announced.put_nowait)
        assert list(json.loads((await soon(announced.get()))["data"])) == [
            "rover-7",
            "rover-7_depth",
        ]

        async def stepping() -> None:
            while True:
                await driver.call("/sim/step", {"ticks": 5})

        stream = f"/stream?topic={COLOURS}"
        assert (await get(address.port, stream)).status == 401
        assert (await get(address.port, f"{stream}&quality=nine")).status == 400
        viewer_, driver_ = (f"Bearer {token}" for token in (VIEWER, DRIVER))
        assert (await get(address.port, "/photos", "POST", Authorization=viewer_)).status == 403
        steps = asyncio.create_task(stepping())
        assert (await get(address.port, "/photos", "POST", Authorization=driver_)).status == 201
        steps.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await steps
    lines = audited(tmp_path)
    refused = [line for line in lines if line["what"] == "viewer refused"]
    assert [(line["client"], line["path"]) for line in refused] == [("127.0.0.1", "/stream")]
    assert "a token is required" in refused[0]["refused"]
    not_taken, taken = (line for line in lines if line["what"] == "photo")
    assert (not_taken["role"], "photo" in not_taken) == ("view", False)
    assert "may not" in not_taken["refused"]
    assert (taken["role"], taken["photo"]) == ("operate", "photo0.jpg")


def test_a_name_that_programs_would_cut_apart_is_refused() -> None:
    with pytest.raises(SettingError, match=r"letters, digits, dots, - and _, got 'a: b, c'"):
        ServeConfig(name="a: b, c")


def test_a_port_for_video_needs_a_camera() -> None:
    with pytest.raises(SettingError, match="--video-port needs --camera"):
        ServeConfig(video_port=8080)
    with pytest.raises(SettingError, match="--webrtc needs --camera"):
        ServeConfig(webrtc=True)
    with pytest.raises(SettingError, match="video-port must be 0 to 65535, got 70000"):
        ServeConfig(camera="kinect", video_port=70000)
