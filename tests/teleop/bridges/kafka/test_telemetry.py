"""Position and list of video streams, from the robot to Kafka."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from teleop.bridges.kafka.telemetry import Locations
from tests.teleop.bridges.kafka.support import bridge, sender, until
from tests.teleop.bridges.support import Broker, robot
from tests.teleop.support import in_a_loop


def odometry(x: float, y: float) -> dict[str, Any]:
    return {"pose": {"pose": {"position": {"x": x, "y": y, "z": 0.0}}}}


def test_a_position_is_published_when_x_or_y_has_changed_by_more_than_a_centimetre(
    tmp_path: Path,
) -> None:
    put: list[bytes] = []
    file = tmp_path / "odometry.txt"
    locations = Locations(put.append, file=file)
    for x, y in ((-0.001, 0.0), (0.008, 0.009), (0.0093, 0.0), (0.0093, -0.012), (1.2345, 7.0)):
        locations.take(odometry(x, y))
    texts = ['{"posx": 0.0, "posy": 0.0}', '{"posx": 0.01, "posy": 0.0}']
    texts += ['{"posx": 0.01, "posy": -0.01}', '{"posx": 1.23, "posy": 7.0}']
    assert [text.decode() for text in put] == texts
    lines = file.read_text().splitlines()
    assert [line.partition(" ")[2] for line in lines] == texts
    assert all(re.match(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d", line) for line in lines)


def test_nested_json_is_a_text_in_json_and_a_file_that_cannot_be_written_stops_nothing(
    tmp_path: Path,
) -> None:
    put: list[bytes] = []
    locations = Locations(put.append, nested=True, file=tmp_path / "none" / "odometry.txt")
    locations.take(odometry(1.0, 2.0))
    locations.take(odometry(3.0, 2.0))
    assert [json.loads(json.loads(text)) for text in put] == [
        {"posx": 1.0, "posy": 2.0},
        {"posx": 3.0, "posy": 2.0},
    ]


@in_a_loop
async def test_position_and_streams_of_the_robot_come_to_their_topics(
    tansu: Broker, topic: str, tmp_path: Path
) -> None:
    names = {"location": f"{topic}.location", "cameras": f"{topic}.cameras"}
    options: dict[str, Any] = {**names, "key": "robot1", "announce": 0.2}
    streams = {"turtlebot": "http://192.168.1.7:8080/stream?topic=/camera/rgb"}
    async with robot() as steps:
        topics, now = steps.server.protocol.topics, steps.server.now
        topics.publish("/cam_sources", {"data": json.dumps(streams)}, now)
        async with (
            bridge(tansu.address, steps.server.url, topic, tmp_path, **options) as running,
            sender(tansu.address, topic) as glasses,
        ):
            await running.reads()
            await until(lambda: topics.wanted("/odom"), running.task)
            topics.publish("/odom", odometry(0.456, -1.0), steps.server.now)
            cameras = await glasses.records(names["cameras"], 3)  # again and again
            topics.publish("/cam_sources", {"data": "no JSON"}, steps.server.now)
            await glasses.records(names["location"], 1)
            topics.publish("/odom", odometry(0.5, -1.0), steps.server.now)
            locations = await glasses.records(names["location"], 2)
    assert [json.loads(record.value) for record in locations] == [
        {"posx": 0.46, "posy": -1.0},
        {"posx": 0.5, "posy": -1.0},
    ]
    assert all(json.loads(record.value) == streams for record in cameras)
    assert {record.key for record in (*locations, *cameras)} == {b"robot1"}
