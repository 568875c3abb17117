"""``/localization/preview_hint`` in lockstep, and its queue on a clock that is just a number."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from localization.types import SECOND, Preview
from teleop.robot.clients.preview_service import NO_ANSWER, OVERTAKEN, PERIOD, PreviewService
from teleop.robot.preview import PreviewAnswer, PreviewRequest
from teleop.ros_types import registry
from teleop.rosbridge.framing.outgoing_frames import OutgoingFrame
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.protocol.protocol import Protocol
from tests.teleop.support import SPAWN, Robots, hint_message, in_a_loop, peer

SERVICE = "/localization/preview_hint"


def pose(x: float, y: float, heading: float) -> dict[str, Any]:
    found: dict[str, Any] = hint_message(x, y, heading)["pose"]["pose"]
    return found


HERE = pose(*SPAWN)
AWAY = pose(SPAWN[0] - 1.5, SPAWN[1] + 0.5, SPAWN[2] + 0.9)

# Over the socket, in lockstep


@in_a_loop
async def test_preview_without_a_sweep_says_so(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        good, values = await client.ask(SERVICE, pose=HERE)
        assert good
        assert values["message"] == "no sweep yet: no scanner has delivered a whole scan"
        assert (values["success"], values["explained"], values["present"]) == (False, -1.0, -1.0)


@in_a_loop
async def test_preview_agrees_with_the_verdict_about_the_hint_that_follows(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/localization/hint_verdict")
        await client.step(30)
        before = (await client.ask(SERVICE, pose=HERE))[1]
        assert before["success"]
        assert before["explained"] > 0.9
        assert before["present"] == -1.0
        share = f"the map explains {before['explained']:.0%} of the last sweep there"
        assert before["message"].startswith(share)
        assert (await client.ask(SERVICE, pose=AWAY))[1]["explained"] < before["explained"] - 0.2
        assert not client.messages("/localization/hint_verdict"), "a preview is no hint"
        await client.hint(hint_message(*SPAWN))
        await client.step(50)
        verdict = client.last("/localization/hint_verdict")
        assert verdict["verdict"] == "accepted"
        after = (await client.ask(SERVICE, pose=verdict["candidates"][0]))[1]
        assert after["explained"] == pytest.approx(verdict["scores"][0], abs=0.03)
        assert after["present"] == pytest.approx(after["explained"], abs=0.03)
        assert "at the present pose" in after["message"]


BAD_POSES = (
    ('{"position":{"x":NaN}}', "NaN is not JSON"),
    ('{"position":{"x":null},"orientation":{"w":1}}', "field pose.position.x"),
    (
        '{"orientation":{"x":0,"y":0,"z":0,"w":0}}',
        "quaternion must have unit norm, got all zeros; try 1 0 0 0",
    ),
    (
        '{"position":{"x":1e9},"orientation":{"w":1}}',
        "(1000000000.0, 0.0) lies outside the map, which spans x",
    ),
    ('{"position":{"x":"here"}}', "position.x"),
)


@in_a_loop
async def test_pose_that_cannot_be_scored_is_answered_with_the_reason(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.step(30)
        for text, complaint in BAD_POSES:
            before = len(client.received)
            await client.say(
                f'{{"op":"call_service","id":"it","service":"{SERVICE}","args":{{"pose":{text}}}}}'
            )
            await client.settle()
            assert complaint in json.dumps(client.received[before:])
        assert (await client.ask(SERVICE, pose=HERE))[1]["success"]


@pytest.mark.slow
@in_a_loop
async def test_previews_in_lockstep_are_all_answered_and_change_no_estimate(robots: Robots) -> None:
    async def path(previews: int) -> list[dict[str, Any]]:
        async with robots() as rig, peer(rig.server.url) as client:
            await client.subscribe("/amcl_pose", "/odom", "/localization/status")
            await client.hint(hint_message(*SPAWN))
            for _ in range(4):
                await client.step(15)
                for _ in range(previews):
                    assert (await client.ask(SERVICE, pose=AWAY))[1]["success"]
            return [o for o in client.received if o["op"] == "publish"]

    assert await path(5) == await path(0)


# The queue to an estimator, which the tests are


class Desk:
    """A protocol with the service, its clients, and what the estimator was asked."""

    def __init__(self, clients: int = 1) -> None:
        self.protocol = Protocol(registry(), limits=ClientLimits.unhurried())
        self.service = PreviewService(self.protocol)
        self.asked: list[PreviewRequest] = []
        self.service.ask = self.asked.append
        self.clients = [self.protocol.connect(0) for _ in range(clients)]
        self.answers: dict[str, dict[str, Any]] = {}
        self.now = 0

    def call(self, identity: str, x: float = 1.0, *, client: int = 0) -> None:
        args = {"pose": {"position": {"x": x}, "orientation": {"w": 1.0}}}
        call = {"op": "call_service", "id": identity, "service": SERVICE, "args": args}
        self.protocol.receive(self.clients[client], json.dumps(call), self.now)
        self._drain()

    def at(self, now: int) -> None:
        self.now = now
        self.protocol.timers.tick(now)
        self._drain()

    def answer(self, request: PreviewRequest, explained: float = 0.5) -> None:
        self.service.answered(PreviewAnswer(request.number, Preview(0, explained, None)))
        self._drain()

    def message(self, identity: str) -> str:
        return str(self.answers[identity]["values"]["message"])

    def _drain(self) -> None:
        for _, frame in self.protocol.connections.drain():
            assert isinstance(frame, OutgoingFrame)
            operation = json.loads(frame.text)
            if operation["op"] == "service_response":
                assert operation["id"] not in self.answers, "one answer for each call"
                self.answers[operation["id"]] = operation


def test_newest_request_of_a_client_follows_and_those_between_are_overtaken() -> None:
    desk = Desk()
    for k in range(5):
        desk.call(f"{k}", x=float(k))
    assert [r.pose.position[0] for r in desk.asked] == [0.0]
    assert [desk.message(f"{k}") for k in (1, 2, 3)] == [OVERTAKEN] * 3
    assert not desk.answers["1"]["values"]["success"]
    desk.answer(desk.asked[0], 0.25)
    assert desk.answers["0"]["values"]["explained"] == 0.25
    assert len(desk.asked) == 1, "not before its time"
    desk.at(PERIOD)
    assert [r.pose.position[0] for r in desk.asked] == [0.0, 4.0]
    desk.answer(desk.asked[1])
    assert sorted(desk.answers) == ["0", "1", "2", "3", "4"]


def test_client_that_asks_a_thousand_times_a_second_has_ten_passed_on_and_all_answered() -> None:
    desk = Desk()
    for k in range(2000):
        desk.at(k * SECOND // 1000)
        desk.call(f"{k}")
        for request in desk.asked:
            desk.answer(request)
    desk.at(3 * SECOND)
    desk.answer(desk.asked[-1])
    assert len(desk.asked) == 21
    assert len(desk.answers) == 2000


def test_request_is_answered_in_time_by_a_localiser_that_is_silent() -> None:
    desk = Desk()
    desk.call("lost")
    desk.at(SECOND)
    desk.call("behind")
    desk.at(2 * SECOND - 1)
    assert desk.message("lost") == NO_ANSWER
    assert len(desk.asked) == 2
    desk.at(3 * SECOND - 1)
    assert desk.message("behind") == NO_ANSWER
    desk.answer(desk.asked[0])  # too late, and nobody waits for it
    desk.call("next")
    desk.answer(desk.asked[-1])
    assert desk.answers["next"]["values"]["success"]


def test_client_that_leaves_is_forgotten_and_others_have_their_answers() -> None:
    desk = Desk(clients=2)
    for client in (0, 1):
        desk.call(f"first of {client}", client=client)
        desk.call(f"second of {client}", client=client)
    desk.protocol.disconnect(desk.clients[0], desk.now)
    desk.service.forget(desk.clients[0])
    for request in list(desk.asked):
        desk.answer(request)
    desk.at(PERIOD)
    for request in desk.asked[2:]:
        desk.answer(request)
    assert {"first of 1", "second of 1"} <= set(desk.answers)
    desk.at(10 * SECOND)
    assert NO_ANSWER not in [desk.message(k) for k in desk.answers if k.endswith("1")]


def test_numbers_of_two_servers_do_not_meet() -> None:
    one, other = Desk(), Desk()
    one.call("a")
    other.call("a")
    assert one.asked[0].number != other.asked[0].number
    assert np.all([0 <= desk.asked[0].number < 2**63 for desk in (one, other)])
