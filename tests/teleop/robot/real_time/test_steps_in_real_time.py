"""Steps of a robot in real time, whose estimates come back from another process."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

from teleop.robot.serving.serve_config import ServeConfig
from tests.teleop.support import InRealTime, Peer, in_a_loop, peer


async def result_of(client: Peer, identity: str) -> dict[str, Any]:
    """Wait for the result of a goal."""

    def found() -> list[dict[str, Any]]:
        return [o for o in client.received if o["op"] == "action_result" and o["id"] == identity]

    await client.until(found, f"the result of {identity}")
    (result,) = found()
    return result


async def newer_pose(client: Peer) -> None:
    """Wait for an estimate that is newer than the last."""
    count = len(client.messages("/amcl_pose"))
    await client.until(lambda: len(client.messages("/amcl_pose")) > count, "a newer pose")


async def driven(client: Peer, distance: float, measure: str) -> dict[str, Any]:
    """Have a step driven; on a machine that is too busy to localise in time it may take several attempts."""
    for attempt in range(100):
        await newer_pose(client)
        identity = f"{measure} {attempt}"
        await client.send(
            op="send_action_goal",
            id=identity,
            action="/move",
            action_type="farsteer_msgs/action/Move",
            args={"distance": distance, "measure_by": measure},
        )
        values: dict[str, Any] = (await result_of(client, identity))["values"]
        if values["outcome"] == "done":
            return values
        assert values["outcome"] in ("lost", "silent"), values
    raise AssertionError(f"no step was driven: {values}")


@pytest.mark.long
@pytest.mark.slow
@in_a_loop
async def test_step_by_the_localiser_is_driven_and_logged_in_real_time(
    in_real_time: InRealTime, tmp_path: Path
) -> None:
    log = tmp_path / "drive.mcap"
    config = ServeConfig(port=0, record=log, log_level="error")
    async with (
        in_real_time(config) as server,
        peer(server.url) as client,
    ):
        await client.subscribe("/amcl_pose")
        await client.until(lambda: client.messages("/amcl_pose"), "a pose")
        first = await driven(client, 0.15, "localization")
        await driven(client, -0.15, "odometry")
    assert first["distance"] == pytest.approx(0.15, abs=0.03)
    with log.with_suffix(".steps.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    done = [row for row in rows if row["outcome"] == "done"]
    assert [row["measured_by"] for row in done] == ["localization", "odometry"]
    assert float(done[0]["true_distance"]) == pytest.approx(0.15, abs=0.05)
