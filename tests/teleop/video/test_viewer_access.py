"""Tokens and tickets for pictures."""

from __future__ import annotations

import json
from pathlib import Path

from websockets.asyncio.client import connect

from tests.teleop.support import in_a_loop, soon
from tests.teleop.video.support import (
    TOKENS,
    TOPIC,
    credentials,
    get,
    picture,
    video,
    viewer,
)

SNAPSHOT = f"/snapshot?topic={TOPIC}"
STREAM = f"/stream?topic={TOPIC}"
VIEW = {"authorization": "Bearer view-view-view-view"}


@in_a_loop
async def test_a_token_is_required_in_the_header_or_as_a_ticket(tmp_path: Path) -> None:
    async with video(tmp_path, tokens=True) as rig:
        for path in (SNAPSHOT, STREAM, "/streams", "/photos", f"/stream_viewer?topic={TOPIC}"):
            refused = await get(rig.port, path)
            assert (refused.status, refused.headers["www-authenticate"]) == (401, "Bearer")
            assert refused.line.startswith("a token is required: in the header Authorization")
        assert picture((await get(rig.port, SNAPSHOT, **VIEW)).body)
        assert (await get(rig.port, "/video_ticket", "POST")).status == 401
        issued = await get(rig.port, "/video_ticket", "POST", **VIEW)
        ticket = issued.json["ticket"]
        assert issued.json == {"ticket": ticket, "valid_seconds": 60.0}
        assert picture((await get(rig.port, f"{SNAPSHOT}&ticket={ticket}")).body)
        assert f"ticket={ticket}" in (await get(rig.port, f"/streams?ticket={ticket}")).line
        assert (await get(rig.port, "/video_ticket", **VIEW)).status == 405


@in_a_loop
async def test_a_ticket_ends_after_a_minute_but_a_stream_that_began_goes_on(tmp_path: Path) -> None:
    async with video(tmp_path, tokens=True) as rig:
        ticket = (await get(rig.port, "/video_ticket", "POST", **VIEW)).json["ticket"]
        rig.time[0] += 59.9
        async with viewer(rig.port, f"{STREAM}&ticket={ticket}") as watching:
            await soon(watching.next())
            rig.time[0] += 0.2
            refused = await get(rig.port, f"{SNAPSHOT}&ticket={ticket}")
            assert refused.status == 401
            assert refused.line.startswith("the ticket is not valid, or not any more; a token is")
            for _ in range(40):
                await soon(watching.next())
        assert (await get(rig.port, f"{SNAPSHOT}&ticket=guess")).status == 401


@in_a_loop
async def test_a_ticket_shows_and_does_not_act(tmp_path: Path) -> None:
    async with video(tmp_path, tokens=True) as rig:
        driver = {"authorization": "Bearer drive-drive-drive-drive"}
        ticket = (await get(rig.port, "/video_ticket", "POST", **driver)).json["ticket"]
        assert (await get(rig.port, f"/photos?ticket={ticket}")).status == 200
        assert (await get(rig.port, f"/photos?ticket={ticket}", "POST")).status == 401
        assert (await get(rig.port, f"/video_ticket?ticket={ticket}", "POST")).status == 401


@in_a_loop
async def test_the_service_gives_a_viewer_a_ticket(tmp_path: Path) -> None:
    async with video(tmp_path, tokens=True) as rig:
        url = f"{rig.server.url}/?token=view-view-view-view"
        async with connect(url, compression=None) as client:
            call = {"op": "call_service", "service": "/video/ticket", "id": "t"}
            await client.send(json.dumps(call))
            answer = json.loads(await soon(client.recv()))
        assert answer["result"] is True
        ticket = answer["values"]["message"]
        assert (await get(rig.port, f"{SNAPSHOT}&ticket={ticket}")).status == 200


@in_a_loop
async def test_a_stream_ends_when_its_token_is_withdrawn(tmp_path: Path) -> None:
    async with video(tmp_path, tokens=True) as rig:
        ticket = (await get(rig.port, "/video_ticket", "POST", **VIEW)).json["ticket"]
        async with viewer(rig.port, STREAM, VIEW) as watching:
            await soon(watching.next())
            left = TOKENS[TOKENS.index("[tokens.driver]") :]
            rig.server.protocol.update_credentials(credentials(tmp_path, left))
            await soon(watching.reader.read())
        assert (
            await get(rig.port, f"{SNAPSHOT}&ticket={ticket}")
        ).line == "the token was withdrawn"


@in_a_loop
async def test_a_role_that_may_not_subscribe_to_the_camera_may_not_watch(tmp_path: Path) -> None:
    async with video(tmp_path, tokens=True) as rig:
        rules = TOKENS + '\n[roles.view]\nsubscribe = ["*", "!/camera/*"]\n'
        rig.server.protocol.update_credentials(credentials(tmp_path, rules))
        refused = await get(rig.port, SNAPSHOT, **VIEW)
        assert (refused.status, refused.line) == (
            403,
            "role view may not subscribe /camera/rgb/image_raw",
        )
