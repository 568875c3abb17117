"""``/teleop/ask``, ``/teleop/give`` and ``/teleop/refuse`` over the socket, in lockstep."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from teleop.rosbridge.errors import ServiceCallError
from tests.teleop.robot.served_robots import (
    DRIVER,
    OTHER,
    VIEWER,
    Serving,
    audited,
    meeting,
    signed_in,
)
from tests.teleop.support import Peer, Robots, arm, in_a_loop, peer

ASK, GIVE, REFUSE = "/teleop/ask", "/teleop/give", "/teleop/refuse"


async def answer(client: Peer, service: str) -> tuple[bool, str]:
    good, values = await client.ask(service)
    assert good
    return values["success"], values["message"]


def asking(client: Peer) -> tuple[int, str, float]:
    state = client.last("/teleop/state")
    return state["asking"], state["asking_name"], state["asking_age"]


@pytest.mark.slow
@in_a_loop
async def test_robot_changes_hands_by_asking_and_giving(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as driver, peer(rig.server.url) as other:
        await driver.subscribe("/teleop/state")
        await arm(driver)
        await driver.step(5)
        assert asking(driver) == (0, "", 0.0)
        session = (await other.ask("/teleop/session"))[1]
        assert (await answer(other, ASK))[0]
        await driver.joy(0.0)
        await driver.step(10)
        number, name, age = asking(driver)
        assert (number, name) == (session["client"], session["name"])
        assert 0.1 <= age <= 0.2
        good, text = await answer(driver, GIVE)
        assert good
        assert text == f"{name} has the robot, and drives after a neutral stick"
        await driver.step(5)
        state = driver.last("/teleop/state")
        assert (state["controller"], state["state"]) == (name, "disarmed")
        assert asking(driver) == (0, "", 0.0)
        for forward in (0.0, 1.0):
            await other.joy(forward)
            await other.settle()
            await driver.step(5)
        assert driver.last("/teleop/state")["linear"] > 0.4


@in_a_loop
async def test_requests_count_before_the_next_tick_takes_them(robots: Robots) -> None:
    async with meeting(robots(), 3) as (_, (driver, other, third)):
        assert await answer(other, ASK) == (False, "nobody drives: the robot is free")
        await arm(driver)
        assert await answer(driver, ASK) == (False, "you drive already")
        assert (await answer(driver, GIVE))[1] == "nobody asks for the robot"
        assert (await answer(other, ASK))[0]
        assert (await answer(other, ASK))[0], "to ask again is no mistake"
        assert "asks already" in (await answer(third, ASK))[1]
        for service in (GIVE, REFUSE):
            assert "only the driver may answer" in (await answer(other, service))[1]
        assert (await answer(driver, REFUSE))[0]
        assert not (await answer(driver, REFUSE))[0]
        assert (await answer(third, ASK))[0]


@in_a_loop
async def test_viewers_ask_in_vain_and_never_answer(serving: Serving, tmp_path: Path) -> None:
    bearers = (DRIVER, OTHER, VIEWER)
    async with signed_in(serving, tmp_path, *bearers) as (_, (driver, other, viewer)):
        await driver.advertise("/cmd_vel", "geometry_msgs/Twist")
        await driver.publish("/cmd_vel", {})
        await driver.call("/sim/step", {"ticks": 1})
        said: dict[str, Any] = await viewer.call(ASK)
        assert not said["success"]
        assert said["message"] == "role view may not drive; connect with a token that may"
        for service in (GIVE, REFUSE):
            with pytest.raises(ServiceCallError, match="role view may not call"):
                await viewer.call(service)
        assert (await other.call(ASK))["success"]
        assert (await driver.call(GIVE))["success"]
    done = [(line["what"], line.get("holder")) for line in audited(tmp_path)]
    for action in (("ask", "viewer"), ("ask", "other"), ("give", "driver")):
        assert action in done
