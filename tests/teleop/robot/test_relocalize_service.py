"""A robot without a pose, behind its server: it finds itself by driving, by itself or on request."""

from __future__ import annotations

import numpy as np
import pytest

from teleop.errors import SettingError
from teleop.operator.operate_config import OperateConfig
from tests.teleop.support import (
    SPAWN,
    InRealTime,
    Peer,
    Robots,
    arm,
    command,
    drive,
    hint_message,
    in_a_loop,
    peer,
    position_of,
)

SEARCH = "/localization/relocalize"


async def listen(client: Peer) -> None:
    await client.subscribe(
        "/localization/status", "/localization/candidates", "/amcl_pose", "/ground_truth/odom"
    )


def error(client: Peer) -> float:
    """Return the distance of the newest pose from the true one [m]."""
    found = position_of(client.last("/amcl_pose"))
    return float(np.linalg.norm((found - position_of(client.last("/ground_truth/odom")))[:2]))


@pytest.mark.slow
@in_a_loop
async def test_robot_without_a_pose_finds_itself_where_it_stands_and_drives_on(
    robots: Robots,
) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await listen(client)
        await client.step(100)
        assert client.last("/localization/status")["health"] == "waiting"
        good, values = await client.ask(SEARCH)
        assert good
        assert values["success"]
        assert values["message"] == "searching the whole map; drive on if several places fit"
        await client.step(150)
        pose = client.last("/amcl_pose")["pose"]["pose"]["position"]
        assert pose["x"] == pytest.approx(SPAWN[0], abs=0.05)
        assert pose["y"] == pytest.approx(SPAWN[1], abs=0.05)
        await arm(client)
        await drive(client, 1.0, steps=40)
        assert client.last("/localization/status")["health"] == "tracking"
        assert client.last("/localization/candidates")["poses"] == []
        assert error(client) < 0.05


@in_a_loop
async def test_one_search_at_a_time_and_one_request_a_second(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client, peer(rig.server.url) as other:
        assert (await client.ask(SEARCH))[1]["success"]
        again = (await client.ask(SEARCH))[1]
        assert not again["success"]
        assert again["message"] == "one request a second: wait for 1.00 s"
        both = (await other.ask(SEARCH))[1]
        assert not both["success"]
        assert both["message"].startswith("a search is under way already")
        await client.step(30)
        assert "wait for 0.40 s" in (await client.ask(SEARCH))[1]["message"]


@in_a_loop
async def test_search_of_a_placed_robot_is_a_check_that_leaves_its_pose(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await listen(client)
        await client.hint(hint_message(*SPAWN))
        await client.step(60)
        assert client.last("/localization/status")["health"] == "tracking"
        assert (await client.ask(SEARCH))[1]["success"]
        await client.step(10)
        assert client.last("/localization/status")["health"] == "suspect"
        assert error(client) < 0.05


@pytest.mark.slow
@in_a_loop
async def test_search_that_the_robot_began_by_itself_gives_way_to_a_requested_one(
    robots: Robots,
) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await listen(client)
        for _ in range(80):
            await client.step(5)
            reasons = client.last("/localization/status")["reasons"]
            if reasons == ["searching the whole map (no pose and no hint)"]:
                break
        else:
            pytest.fail("the robot did not begin to search by itself")
        assert (await client.ask(SEARCH))[1]["success"]
        await client.step(5)
        reasons = client.last("/localization/status")["reasons"]
        assert reasons == ["searching the whole map (requested)"]


@pytest.mark.long
@pytest.mark.process
@in_a_loop
async def test_operator_has_the_robot_found_with_an_option(in_real_time: InRealTime) -> None:
    async with in_real_time() as server, peer(server.url) as client:
        await listen(client)
        # While the robot still looks where it begins, a request is refused: a search is under way already.
        await client.until(
            lambda: (
                client.messages("/localization/status")
                and client.last("/localization/status")["health"] == "tracking"
            )
        )
        options = ("--no-viewer", "--duration", "8", "--find")
        status, out, err = await command("operate", server.url, *options)
    assert status == 0, err
    assert f"{SEARCH}: searching the whole map; drive on if several places fit" in out + err
    assert "drive on to make sure" in out + err


def test_operator_gives_a_hint_or_has_the_map_searched() -> None:
    with pytest.raises(SettingError, match="give one of them"):
        OperateConfig(hint=(0.0, 0.0, 0.0), find=True)
