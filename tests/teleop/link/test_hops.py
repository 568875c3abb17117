"""Whose part of the way a delay is: in figures, and over real sockets with a link that changes while it runs."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace
from statistics import median

import pytest

from teleop.link.emulation import LinkConfig, LinkEmulation
from teleop.link.hops import WINDOW, Answer, GrowthWatch, RobotClock, command_hops, view_hops
from teleop.link.report import LinkReport, measure
from teleop.robot.clients.link_service import LinkService
from teleop.ros_types import registry
from teleop.rosbridge import Protocol, Server
from teleop.rosbridge.client.client import Client
from teleop.rosbridge.ros_time import SECOND
from tests.teleop.support import in_a_loop

POSE = "/amcl_pose"
OFFSET = 1000.0
"""What the robot's clock shows when the client's shows 0 [s]."""
QUIET = {"robot": 0.03, "queue": 0.001, "wire": 0.02, "wire up": 0.02, "gateway": 0.01}
"""Parts of the way while nothing is wrong [s]."""


def answer_at(now: float, way: dict[str, float], lag: float = 0.4) -> tuple[Answer, float, float]:
    """Return an answer at a time of the robot, with stamp and arrival of the message before it."""
    asked, came = now - way["wire up"] - OFFSET, now + way["wire"] - OFFSET
    captured = now - way["robot"] - way["queue"]
    answer = Answer(
        *(asked, came, now, now - lag, way["gateway"]), {POSE: way["robot"]}, {POSE: way["queue"]}
    )
    return answer, captured - lag, came


@pytest.mark.parametrize("part", QUIET)
def test_delay_that_is_added_to_one_part_of_the_way_is_that_part_s(part: str) -> None:
    clock, before, after = RobotClock(), dict[str, float](), dict[str, float]()
    for way, hops in (QUIET, before), ({**QUIET, part: QUIET[part] + 0.2}, after):
        for i in range(20):
            answer, stamp, came = answer_at(1010.0 + (way is not QUIET) + 0.05 * i, way)
            clock.add(answer)
            seen = view_hops(answer, clock, POSE, stamp, came)
            assert seen is not None
            hops.update(seen | command_hops(answer, clock))
    grown = {name: after[name] - before[name] for name in after}
    assert grown.pop(part) == pytest.approx(0.2, abs=0.005)
    assert max(map(abs, grown.values())) < 0.005


def test_parts_add_up_to_the_age_of_what_is_seen() -> None:
    clock = RobotClock()
    answer, stamp, came = answer_at(1010.0, QUIET)
    clock.add(answer)
    hops = view_hops(answer, clock, POSE, stamp, came)
    assert hops is not None
    assert sum(hops.values()) == pytest.approx(0.03 + 0.001 + 0.02)


def test_unknown_parts_and_ways_without_a_command_are_left_out() -> None:
    clock = RobotClock()
    answer, stamp, came = answer_at(1010.0, QUIET)
    clock.add(answer)
    assert view_hops(replace(answer, made={POSE: -1.0}), clock, POSE, stamp, came) is None
    assert view_hops(answer, clock, "/scan", stamp, came) is None
    assert set(command_hops(replace(answer, taken=-1.0), clock)) == {"wire up"}


def test_queue_that_grows_by_tenths_of_seconds_is_named_within_two_seconds() -> None:
    watch = GrowthWatch()
    steady = [watch.add(t / 4, {"queue": 0.01, "wire": 0.05 + 0.01 * (t % 2)}) for t in range(40)]
    assert set(steady) == {None}
    named = [watch.add(10 + t / 4, {"queue": 0.01 + t / 20, "wire": 0.05}) for t in range(1, 9)]
    assert "queue" in named[: round(4 * WINDOW)]
    assert set(named) == {None, "queue"}


async def _publish(server: Server, *, size: int = 0, age: int = 0) -> None:
    """Publish poses twenty times a second that were captured some time [ns] before."""
    topics = server.protocol.topics
    topic = topics.advertise(POSE, "geometry_msgs/PoseWithCovarianceStamped", newest=True)
    while True:
        now = server.now
        sec, nanosec = divmod(now - age, SECOND)
        header = {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": "m" * size}
        topics.publish_on(topic, {"header": header}, now, captured=now - age)
        await asyncio.sleep(0.05)


async def _report(words: tuple[str, ...], *, size: int = 0, age: int = 0) -> LinkReport:
    """Measure over a good link, then over another one."""
    good = LinkEmulation(LinkConfig.parse(("delay=0.02",)))
    protocol = Protocol(registry(), frame_delay=good)
    server = Server(protocol, port=0)
    LinkService(server)
    async with server, Client(server.url, reconnect=False) as client:
        publishing = asyncio.create_task(_publish(server, size=size, age=age))
        begun = time.perf_counter()
        async with asyncio.TaskGroup() as tasks:
            measuring = tasks.create_task(measure(client, 4.0, time.perf_counter, (POSE,)))
            await asyncio.sleep(1.5)
            protocol.emulate(LinkEmulation(LinkConfig.parse(words)))
        assert time.perf_counter() - begun < 30.0
        publishing.cancel()
    return measuring.result()


def _grown(report: LinkReport, way: str, part: str) -> float:
    """Return by how much a part has grown between the first second and the last [s]."""
    values = [hops[part] for hops in report.ways[way] if part in hops]
    return min(values[-4:]) - median(values[:4])


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("word", "grows"), [("up.delay=0.32", "wire up"), ("down.delay=0.32", "wire")]
)
@in_a_loop
async def test_delay_of_one_direction_is_seen_in_that_direction(word: str, grows: str) -> None:
    report = await _report(("delay=0.02", word), age=SECOND // 10)
    for way, part in ((POSE, "robot"), (POSE, "queue"), (POSE, "wire"), ("commands", "wire up")):
        added = 0.3 if part == grows else 0.0
        # Ten milliseconds or five per cent, and what a busy machine takes longer to do.
        assert _grown(report, way, part) == pytest.approx(added, abs=0.015), part
    assert median(h["robot"] for h in report.ways[POSE]) == pytest.approx(0.1, abs=0.01)


@pytest.mark.slow
@pytest.mark.long
@in_a_loop
async def test_queue_before_a_link_that_carries_too_little_is_named() -> None:
    report = await _report(("delay=0.02", "down.rate=30000"), size=3000)
    assert f"queue of {POSE}" in report.growing
    assert _grown(report, POSE, "robot") < 0.01
    assert any("has grown" in line for line in report.lines())
