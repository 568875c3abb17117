"""The requests of the AR glasses, byte for byte, before a real broker."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest

from tests.teleop.bridges.rest.support import JSON, PLAIN, glasses, proxy
from tests.teleop.bridges.support import PATIENCE, Broker
from tests.teleop.support import in_a_loop

CREATE = (
    '{"name": "url_instance", "format": "json",'
    ' "auto.offset.reset": "latest", "auto.commit.enable": "true"}'
)
SOURCES = {
    "turtlebot": "http://192.168.1.7:8080/stream?topic=/camera/rgb/image_rect_color&type=mjpeg&quality=30",
    "beach": "http://192.168.1.9/beach",
}


@pytest.mark.long
@pytest.mark.slow
@in_a_loop
async def test_the_glasses_find_the_streams_and_send_their_commands(
    tansu: Broker, topic: str
) -> None:
    cams, group = f"{topic}.cam_sources", f"{topic}.cam_sources_consumer"
    instance = f"/consumers/{group}/instances/url_instance"
    async with proxy(tansu.address) as server, glasses(server.url) as client:
        post = (f"Content-Type: {JSON}",)
        # A topic is made when it is first used.
        await client.ask(f"POST /topics/{cams}", '{"records": [{"value": {"old": "x"}}]}', *post)

        create = (*post, f"Accept: {PLAIN}")
        status, media, made = await client.ask(f"POST /consumers/{group}", CREATE, *create)
        assert (status, media) == (200, PLAIN)
        assert made == {
            "instance_id": "url_instance",
            "base_uri": f"http://127.0.0.1:8082{instance}",
        }
        status, _, again = await client.ask(f"POST /consumers/{group}", CREATE, *create)
        assert status == 409, "as at every second start of the glasses, which ignore it"
        assert again["error_code"] == 40902

        topics = json.dumps({"topics": [cams]})
        answer = await client.ask(f"POST {instance}/subscription", topics, f"Content-Type: {PLAIN}")
        assert answer == (204, "", None)

        records: list[Any] = []
        async with asyncio.timeout(PATIENCE):  # the group takes seconds to form
            while not records:
                body = json.dumps({"records": [{"value": SOURCES}]})
                await client.ask(f"POST /topics/{cams}", body, *post)
                status, media, records = await client.ask(
                    f"GET {instance}/records", "", f"Accept: {JSON}"
                )
                assert (status, media) == (200, JSON)
        assert records[-1]["value"] == SOURCES
        assert records[-1].keys() == {"topic", "key", "value", "partition", "offset"}

        for number, value in enumerate(({"distance": "0.5"}, {"movement": "up"}, {"angle": "15"})):
            body = json.dumps({"records": [{"value": value}]})
            status, media, sent = await client.ask(f"POST /topics/{topic}", body, *post)
            assert (status, media) == (200, PLAIN)
            (offset,) = sent["offsets"]
            assert offset["error_code"] is None
            assert number or offset["offset"] == 0

        assert await client.ask(f"DELETE {instance}") == (204, "", None)
        status, _, gone = await client.ask(f"DELETE {instance}")
        assert (status, gone["error_code"]) == (404, 40403)
        status, _, names = await client.ask("GET /topics", "", f"Accept: {PLAIN}")
        assert status == 200
        assert {cams, topic} <= set(names)
