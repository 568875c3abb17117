"""Requests that cannot be followed: status, code and reason of each, on the wire."""

from __future__ import annotations

import asyncio
import base64
import json
from collections.abc import Callable
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import pytest

from teleop.bridges.rest import consumers as module
from teleop.bridges.rest.bounded_server import MAX_OF_ADDRESS
from teleop.bridges.rest.consumers import IDLE, MAX_CONSUMERS, Consumers
from teleop.bridges.rest.errors import RestError
from teleop.bridges.rest.handlers import MAX_BODY
from tests.teleop.bridges.rest.support import JSON, PLAIN, glasses, proxy
from tests.teleop.bridges.support import PATIENCE, Broker, broker, free_port
from tests.teleop.support import in_a_loop

ONE = '{"records": [{"value": 1}]}'
SEND = f"Content-Type: {JSON}"
TELL = f"Content-Type: {PLAIN}"
BINARY = "Content-Type: application/vnd.kafka.binary.v2+json"
C = "/consumers/g/instances/c"

STAMP = '{"records": [{"value": 1, "timestamp": %d}]}'
OFFSET = '{"offsets": [{"topic": "t", "partition": %d, "offset": %d}]}'

REFUSED = [
    ("POST /topics/a%20b", ONE, [SEND], 40401, "Topic not found: a b"),
    (f"POST {C}/subscription", '{"topics": ["a/b"]}', [TELL], 40401, "Topic not found: a/b"),
    ("DELETE /consumers/g/instances/none", "", [], 40403, "Consumer instance not found"),
    ("GET /consumers/g/instances/none/records", "", [], 40403, "Consumer instance"),
    ("POST /consumers/g/instances/none/subscription", "{}", [TELL], 40403, "Consumer inst"),
    ("POST /consumers/g/instances/none/offsets", "{}", [TELL], 40403, "Consumer instance"),
    ("GET /nowhere", "", [], 404, "Not Found"),
    ("DELETE /topics", "", [], 405, "Method Not Allowed"),
    ("GET /topics", "", ["Accept: text/html"], 40601, f"Accept must allow {PLAIN}"),
    ("POST /topics/t", ONE, [SEND, "Accept: image/png"], 40601, "Accept must allow"),
    (f"GET {C}/records", "", ["Accept: text/html"], 40601, "Accept must allow"),
    (f"GET {C}/records", "", ["Accept: application/vnd.kafka.binary.v2+json"], 40601, "not match"),
    (
        f"POST {C}/subscription",
        '{"topics": ["a"], "topic_pattern": "b"}',
        [TELL],
        40901,
        "mutually",
    ),
    ("POST /consumers/g", '{"name": "c"}', [TELL], 40902, "already exists"),
    ("POST /topics/t", ONE, ["Content-Type: text/plain"], 41501, "json.v2"),
    ("POST /topics/t", ONE, [], 41501, "Content-Type must be"),
    ("POST /consumers/g", "{}", ["Content-Type: text/plain"], 41501, PLAIN),
    (f"POST {C}/subscription", "{}", ["Content-Type: text/plain"], 41501, PLAIN),
    ("POST /topics/t", "{", [SEND], 42201, "it is no JSON"),
    ("POST /topics/t", "[]", [SEND], 42201, "it must be an object"),
    ("POST /topics/t", "[" * 100_000, [SEND], 42201, "it is no JSON"),
    ("POST /topics/t", '{"records": []}', [SEND], 42201, "1 to 1000 records"),
    ("POST /topics/t", '{"records": [{"key": 1}]}', [SEND], 42201, "records[0] must be"),
    ("POST /topics/t", '{"records": [{"value": 1, "x": 2}]}', [SEND], 42201, "records[0]"),
    ("POST /topics/t", '{"records": [{"value": NaN}]}', [SEND], 42201, "records[0].value has"),
    (
        "POST /topics/t",
        '{"records": [{"value": [-1e999]}]}',
        [SEND],
        42201,
        "[0].value has a number",
    ),
    (
        "POST /topics/t",
        '{"records": [{"value": 1, "partition": -1}]}',
        [SEND],
        42201,
        "[0].partition must be a whole",
    ),
    ("POST /topics/t", '{"records": [{"value": "?"}]}', [BINARY], 42201, "no base64"),
    ("POST /topics/t", ONE, [BINARY], 42201, "base64 in a text"),
    ("POST /topics/t", STAMP % 2**70, [SEND], 42201, "records[0].timestamp must be millisec"),
    ("POST /topics/t", STAMP % 2e18, [SEND], 42201, "an hour ahead of this machine's clock"),
    ("POST /topics/t", STAMP % -1, [SEND], 42201, "records[0].timestamp must be a whole"),
    (f"POST {C}/subscription", '{"topic_pattern": "b"}', [TELL], 42201, "patterns are not"),
    (f"POST {C}/subscription", '{"topics": []}', [TELL], 42201, "topics must be"),
    (f"GET {C}/records?timeout=soon", "", [], 42201, "timeout must be a whole number"),
    (f"POST {C}/offsets", '{"offsets": [{}]}', [TELL], 42201, "offsets[0] must have"),
    (f"POST {C}/offsets", OFFSET % (0, 2**70), [TELL], 42201, "offsets[0] must have"),
    (f"POST {C}/offsets", OFFSET % (2**31, 0), [TELL], 42201, "offsets[0] must have"),
    ("POST /consumers/g", '{"name": "a b"}', [TELL], 42201, "letters, digits"),
    ("POST /consumers/g", '{"format": "avro"}', [TELL], 42204, "json or binary"),
    ("POST /consumers/g", '{"colour": "red"}', [TELL], 42204, "unknown colour; known are"),
    ("POST /consumers/g", '{"auto.offset.reset": "none"}', [TELL], 42204, "latest or earl"),
    ("POST /consumers/g", '{"auto.commit.enable": 3}', [TELL], 42204, "true or false"),
    ("POST /consumers/g", '{"consumer.request.timeout.ms": "x"}', [TELL], 42204, "whole number"),
]


@in_a_loop
async def test_each_request_that_cannot_be_followed_is_answered_with_its_code_and_reason() -> None:
    async with proxy(f"127.0.0.1:{free_port()}") as server, glasses(server.url) as client:
        made = await client.ask("POST /consumers/g", '{"name": "c", "format": "json"}', TELL)
        assert made[0] == 200
        for line, body, headers, code, words in REFUSED:
            status, media, answer = await client.ask(line, body, *headers)
            assert answer["error_code"] == code, (line, body[:60], answer)
            assert str(status) == str(code)[:3]
            assert media == PLAIN
            assert words in answer["message"]
        assert (await client.ask(f"GET {C}/records", "", f"Accept: {JSON}"))[0] == 200


@in_a_loop
async def test_a_partition_that_is_not_there_is_named_and_nothing_is_sent(
    tansu: Broker, topic: str
) -> None:
    async with proxy(tansu.address) as server, glasses(server.url) as client:
        both = '{"records": [{"value": 1}, {"value": 2, "partition": 900}]}'
        status, _, answer = await client.ask(f"POST /topics/{topic}", both, SEND)
        assert (status, answer["error_code"]) == (404, 40402)
        assert answer["message"] == "Partition not found: 900"
        one = '{"records": [{"value": 1, "partition": 0}]}'
        _, _, sent = await client.ask(f"POST /topics/{topic}", one, SEND)
        assert sent["offsets"][0]["offset"] == 0


@in_a_loop
async def test_a_broker_that_is_not_there_is_said_so() -> None:
    async with proxy(f"127.0.0.1:{free_port()}") as server, glasses(server.url) as client:
        status, _, answer = await client.ask("POST /topics/t", ONE, SEND)
        assert (status, answer["error_code"]) == (500, 50002)
        assert answer["message"].startswith("Kafka error: ")


@in_a_loop
async def test_a_broker_that_has_moved_is_asked_for_at_the_address_that_was_given(
    tmp_path: Path,
) -> None:
    with broker(tmp_path, advertised=free_port()) as moving:
        async with proxy(moving.direct) as server, glasses(server.url) as client:
            assert (await client.ask("GET /topics"))[0] == 500
            moving.kill()
            moving.address = moving.direct
            moving.start()
            assert (await client.ask("GET /topics"))[0] == 200


@in_a_loop
async def test_who_has_not_the_token_and_who_is_a_web_page_may_not_ask(tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("s3cret\n")
    basic = base64.b64encode(b"anybody:s3cret").decode()
    line = f"GET {C}/subscription"
    async with (
        proxy(f"127.0.0.1:{free_port()}", token_file=token) as server,
        glasses(server.url) as client,
    ):
        for header in (
            "X: y",
            "Authorization: Bearer wrong",
            "Authorization: Basic czNjcmV0",
            "Authorization: Basic ?",
            "Authorization: Digest s3cret",
        ):
            async with glasses(server.url) as refused:
                status, _, answer = await refused.ask(line, "", header)
                assert (status, answer["error_code"]) == (401, 40101), header
                assert not await refused.reader.read(), "the connection is closed"
        for header in ("Authorization: Bearer s3cret", f"authorization: basic {basic}"):
            assert (await client.ask(line, "", header))[2]["error_code"] == 40403, header
        known = "Authorization: Bearer s3cret"
        for header in ("Origin: http://evil.example", "Sec-Fetch-Site: cross-site"):
            async with glasses(server.url) as page:
                status, _, answer = await page.ask(line, "", known, header)
                assert (status, answer["error_code"]) == (403, 40301), header
        status, _, answer = await client.ask(line, "", known, host="evil.example:8082")
        assert (status, answer["error_code"]) == (403, 40301)


@in_a_loop
async def test_a_body_above_a_megabyte_is_not_read() -> None:
    async with proxy(f"127.0.0.1:{free_port()}") as server:
        async with glasses(server.url) as client:
            head = f"POST /topics/t HTTP/1.1\r\nHost: 127.0.0.1\r\n{SEND}\r\n"
            client.writer.write(f"{head}Content-Length: {MAX_BODY + 1}\r\n\r\n".encode())
            assert b" 400 " in await client.reader.readline()
            while await client.reader.read(4096):
                pass
        async with glasses(server.url) as client:  # and the next one is served
            body = json.dumps({"records": [{"value": "x" * (MAX_BODY - 100)}], "more": []})
            status, _, answer = await client.ask("POST /topics/a%20b", body, SEND)
            assert (status, answer["error_code"]) == (404, 40401)


@in_a_loop
async def test_topics_of_the_broker_and_topics_that_nobody_may_send_to_are_refused() -> None:
    async with proxy(f"127.0.0.1:{free_port()}", send_to="turtle_control,other") as server:

        async def refusal(line: str, body: str, header: str) -> str:
            async with glasses(server.url) as client:
                await client.ask("POST /consumers/g", '{"name": "c"}', TELL)
                status, _, answer = await client.ask(line, body, header)
                assert (status, answer["error_code"]) == (403, 40301), line
                return str(answer["message"])

        said = await refusal("POST /topics/__consumer_offsets", ONE, SEND)
        assert said == "__consumer_offsets is the broker's own, as all topics that begin with __"
        both = '{"topics": ["a", "__x"]}'
        assert "__x is the broker's own" in await refusal(f"POST {C}/subscription", both, TELL)
        said = await refusal("POST /topics/turtle_result", ONE, SEND)
        words = "nothing is sent to turtle_result, only to other, turtle_control; see --send-to"
        assert said == words
        async with glasses(server.url) as client:
            status, _, answer = await client.ask("POST /topics/other", ONE, SEND)
            assert (status, answer["error_code"]) == (500, 50002), "allowed; there is no broker"


@in_a_loop
async def test_a_body_is_not_read_from_who_has_not_the_token(tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("s3cret\n")
    async with proxy(f"127.0.0.1:{free_port()}", token_file=token) as server:
        for length in ("Content-Length: 900000", "Transfer-Encoding: chunked"):
            async with glasses(server.url) as client:
                head = f"POST /topics/t HTTP/1.1\r\nHost: 127.0.0.1\r\n{SEND}\r\n{length}\r\n\r\n"
                client.writer.write(head.encode())  # and nothing of the body
                async with asyncio.timeout(PATIENCE):
                    answer = (await client.reader.read()).decode()
                assert answer.startswith("HTTP/1.1 401 ")
                assert "Connection: close" in answer
                assert answer.endswith('as password of Basic"}')


@in_a_loop
async def test_an_address_has_a_bounded_number_of_connections_and_room_again_when_they_close() -> (
    None
):
    async with proxy(f"127.0.0.1:{free_port()}") as server, AsyncExitStack() as held:
        for _ in range(MAX_OF_ADDRESS):
            client = await held.enter_async_context(glasses(server.url))
            assert (await client.ask("GET /nowhere"))[0] == 404
        async with glasses(server.url) as one_more:
            answer = await one_more.reader.read()
            assert answer.startswith(b"HTTP/1.1 503 ")
            assert b"there are too many connections already" in answer
        assert (await client.ask("GET /nowhere"))[0] == 404, "the others are served"
        client.writer.close()
        await client.writer.wait_closed()
        async with asyncio.timeout(PATIENCE):
            while True:
                async with glasses(server.url) as next_one:
                    next_one.writer.write(b"GET /nowhere HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
                    if b" 404 " in await next_one.reader.readline():
                        break


def collection(now: Callable[[], float]) -> Consumers:
    return Consumers({"bootstrap_servers": "127.0.0.1:1"}, now)


@in_a_loop
async def test_there_are_at_most_64_consumers_and_those_that_nobody_asks_end() -> None:
    time = 100.0
    consumers = collection(lambda: time)
    for number in range(MAX_CONSUMERS):
        consumers.create("g", {"name": f"c{number}"})
    with pytest.raises(RestError, match="64 consumers already") as full:
        consumers.create("g", {})
    assert (full.value.status, full.value.code) == (429, 42901)
    time += IDLE - 1.0
    consumers.find("g", "c3")
    waiting = consumers.find("g", "c5")
    await consumers.end_idle()
    assert len(consumers) == MAX_CONSUMERS
    time += 2.0
    await consumers.end_idle()
    assert len(consumers) == 2
    with pytest.raises(RestError, match="Consumer instance not found"):
        consumers.find("g", "c4")
    time += IDLE + 1.0
    async with waiting.busy:  # a request of its is being answered
        await consumers.end_idle()
        assert len(consumers) == 1
    assert consumers.create("g", {}).name.startswith("rest-consumer-")


@in_a_loop
async def test_a_consumer_that_is_deleted_while_it_subscribes_leaves_no_connection(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun, go, stopped = asyncio.Event(), asyncio.Event(), []

    class Client:
        async def start(self) -> None:
            begun.set()
            await go.wait()

        async def stop(self) -> None:
            stopped.append(self)

    def make(**_: Any) -> Client:
        return Client()

    monkeypatch.setattr(module, "AIOKafkaConsumer", make)
    consumers = collection(lambda: 0.0)
    made = consumers.create("g", {"name": "c"})
    subscribing = asyncio.create_task(made.subscribe(["t"]))
    await begun.wait()
    await consumers.delete("g", "c")
    go.set()
    with pytest.raises(RestError, match="Consumer instance not found"):
        await subscribing
    assert len(stopped) == 1
