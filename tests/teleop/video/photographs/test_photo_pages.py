"""Photographs over HTTP and on rosbridge, over real sockets."""

from __future__ import annotations

import asyncio
import json
import threading
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

from teleop.video.photographs import photographer
from teleop.video.photographs.photo_rate import PhotoRate
from tests.teleop.support import in_a_loop, soon
from tests.teleop.video.support import HEIGHT, TOPIC, WIDTH, VideoRig, get, picture, video

DRIVER = {"authorization": "Bearer drive-drive-drive-drive"}
VIEWER = {"authorization": "Bearer view-view-view-view"}


async def call_photo(rig: VideoRig, token: str = "") -> Any:
    """Call the service, and return the answer."""
    async with connect(f"{rig.server.url}/?token={token}", compression=None) as client:
        await client.send(
            json.dumps({"op": "call_service", "service": "/camera/photo", "id": "photo"})
        )
        while (answer := json.loads(await soon(client.recv()))).get("id") != "photo":
            pass
        return answer


@in_a_loop
async def test_photographs_are_taken_by_post_or_service_and_listed_and_fetched_by_get(
    tmp_path: Path,
) -> None:
    async with video(tmp_path) as rig:
        assert (await get(rig.port, "/photos")).json == {"photos": []}
        taken = await get(rig.port, "/photos", "POST")
        assert (taken.status, taken.headers["location"]) == (201, "/photos/photo0.jpg")
        assert taken.json["name"] == "photo0.jpg"
        answer = await call_photo(rig)
        assert answer["result"] is True
        assert answer["values"]["name"] == "photo1.jpg"
        assert answer["values"]["stamp"]["sec"] >= taken.json["stamp"] // 1_000_000_000
        listed = (await get(rig.port, "/photos")).json["photos"]
        assert [photo["name"] for photo in listed] == ["photo0.jpg", "photo1.jpg"]
        photo = await get(rig.port, listed[1]["url"])
        assert photo.headers["content-type"] == "image/jpeg"
        assert photo.headers["cross-origin-resource-policy"] == "same-origin"
        assert (picture(photo.body).size, len(photo.body)) == ((WIDTH, HEIGHT), listed[1]["bytes"])
        record = (await get(rig.port, "/photos/photo0.json")).json
        assert (record["by"], record["stamp"]) == ("127.0.0.1", taken.json["stamp"])
        assert {wanted.quality for wanted in rig.encoded} == {95}


@in_a_loop
async def test_a_get_takes_no_photograph_and_others_are_not_found(tmp_path: Path) -> None:
    async with video(tmp_path) as rig:
        for path in ("/photos/photo0.jpg", "/photos/..%2f..%2ftokens.toml", "/photos/"):
            answer = await get(rig.port, path)
            assert (answer.status, answer.line.endswith("GET /photos lists them")) == (404, True)
        assert (await get(rig.port, "/photos/photo0.jpg", "POST")).status == 405
        assert (await get(rig.port, "/photos")).json == {"photos": []}


@in_a_loop
async def test_only_those_who_may_drive_take_photographs_and_viewers_see_them(
    tmp_path: Path,
) -> None:
    async with video(tmp_path, tokens=True) as rig:
        assert (await get(rig.port, "/photos", "POST")).status == 401
        refused = await get(rig.port, "/photos", "POST", **VIEWER)
        assert (refused.status, refused.line) == (403, "role view may not call /camera/photo")
        assert (await get(rig.port, "/photos", "POST", **DRIVER)).status == 201
        assert (await get(rig.port, "/photos/photo0.jpg", **VIEWER)).status == 200
        refused_call = await call_photo(rig, "view-view-view-view")
        assert refused_call["result"] is False
        assert (await call_photo(rig, "drive-drive-drive-drive"))["result"] is True
        beside = (await get(rig.port, "/photos/photo0.json", **VIEWER)).json
        assert beside["by"] == "driver"


@in_a_loop
async def test_what_fails_is_answered_and_logged_once_and_the_server_goes_on(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with video(tmp_path, most=0) as rig:
        for _ in range(2):
            refused = await get(rig.port, "/photos", "POST")
            assert (refused.status, refused.line.endswith("the most it may: move some away")) == (
                503,
                True,
            )
        answer = await call_photo(rig)
        assert (answer["result"], refused.line in answer["values"]) == (False, True)
        assert [r.getMessage() for r in caplog.records] == [f"no photograph: {refused.line}"]
        assert (await get(rig.port, f"/snapshot?topic={TOPIC}")).status == 200


@in_a_loop
async def test_a_disk_that_hangs_holds_up_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(photographer, "_DISK_TIMEOUT", 0.2)
    async with video(tmp_path) as rig:
        port, released = rig.port, threading.Event()
        monkeypatch.setattr(
            rig.photographer._folder, "store", lambda *photo: released.wait() and "photo0.jpg"
        )
        taking = [asyncio.create_task(get(port, "/photos", "POST")) for _ in range(6)]
        assert (await get(port, f"/snapshot?topic={TOPIC}")).status == 200
        lines = [(await soon(each)).line for each in taking]
        released.set()
        assert sum("does not respond" in line for line in lines) == 4
        assert sum("still being taken" in line for line in lines) == 2


@in_a_loop
async def test_each_client_takes_one_photograph_a_second_by_whatever_way(tmp_path: Path) -> None:
    async with video(tmp_path, tokens=True, rate=PhotoRate()) as rig:
        assert (await get(rig.port, "/photos", "POST", **DRIVER)).status == 201
        refused = await get(rig.port, "/photos", "POST", **DRIVER)
        assert (refused.status, refused.headers["retry-after"]) == (429, "1")
        assert refused.line.startswith("one photograph in 1 s for each client: wait for 0.")
        call = await call_photo(rig, "drive-drive-drive-drive")
        assert (call["result"], call["values"][:18]) == (False, "one photograph in ")
        assert len((await get(rig.port, "/photos", **VIEWER)).json["photos"]) == 1


def test_photographs_of_others_and_of_later_are_not_refused() -> None:
    rate, second = PhotoRate(), 1_000_000_000
    assert not rate.refusal("one", 0)
    assert not rate.refusal("other", 0)
    assert rate.refusal("one", second - 1)
    assert not rate.refusal("one", second), "a refused one does not count"
    assert rate.refusal("one", 2 * second - 1)
