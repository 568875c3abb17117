"""The topics and services of a console on a robot in real time, whose parts are processes of their own."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from tests.teleop.robot.topics.test_lean_cloud import unpacked
from tests.teleop.support import InRealTime, in_a_loop, peer

pytestmark = [pytest.mark.process, pytest.mark.slow]


@in_a_loop
async def test_console_has_what_it_needs_in_real_time(in_real_time: InRealTime) -> None:
    async with (
        in_real_time() as served,
        peer(served.url) as driver,
        peer(served.url) as other,
    ):
        await other.subscribe("/robot_description", "/teleop/state", "/amcl_pose")
        await other.subscribe("/local_cloud/lean", compression="cbor")

        session = (await other.ask("/teleop/session"))[1]
        assert session["may_take_over"]
        assert not session["tokens"]
        await other.send(op="advertise_service", service="/sim/step", type="std_srvs/srv/Trigger")
        (refused,) = await other.settle()
        assert refused["level"] == "error"
        assert await other.ask("/sim/step", ticks=1) == (
            False,
            "time passes by itself here; farsteer serve --lockstep has this service",
        )
        await other.until(lambda: other.messages("/robot_description"), "the robot's shape")
        root = ElementTree.fromstring(other.last("/robot_description")["data"])
        assert root.get("name") == "p3at"
        await other.until(lambda: len(other.messages("/local_cloud/lean")) > 2, "the lean cloud")
        points, _ = unpacked(other.last("/local_cloud/lean")["data"])
        assert len(points) > 100

        pose = other.last("/amcl_pose")["pose"]["pose"]
        preview = (await other.ask("/localization/preview_hint", pose=pose))[1]
        assert preview["success"], preview
        assert preview["explained"] > 0.9
        assert preview["present"] == pytest.approx(preview["explained"], abs=0.1)

        async def until(true: object) -> None:
            assert callable(true)
            await other.until(lambda: true(other.last("/teleop/state")), "the state")

        await driver.joy(0.0)
        await until(lambda state: state["controller"])
        assert (await other.ask("/teleop/ask"))[1]["success"]
        await until(lambda state: state["asking_name"] == session["name"])
        await driver.joy(0.0)
        assert (await driver.ask("/teleop/give"))[1]["success"]
        await until(lambda state: state["controller"] == session["name"])
        assert other.last("/teleop/state")["asking"] == 0

        received = len(other.messages("/teleop/state"))  # more may come behind the answer
        link = (await other.ask("/teleop/link"))[1]
        counts = dict(zip(link["topics"], link["sent"], strict=True))
        assert counts["/teleop/state"] >= received > 1
        assert counts["/robot_description"] == 1
        assert link["bytes"] > sum(len(f) for f in other.frames if isinstance(f, bytes)) > 1000
        # The least that it can have been: 0 where ping and answer met in one pass of a busy loop; -1 were none.
        assert 0.0 <= link["round_trip"] < 60.0
