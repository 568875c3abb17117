"""``farsteer scenario host``: a robot for tests in any language; the referee's token moves the world, nobody else does."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from typing import Any

import pytest
from websockets.sync.client import connect

from teleop.scenario.robot_process import RobotError, RobotProcess, robot_document

CALL = {
    "op": "call_service",
    "id": "1",
    "service": "/sim/step_simulation",
    "args": {"steps": 5},
}


def answer(url: str, token: str = "") -> dict[str, Any]:
    """Have a client step the world, and return what it is answered."""
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    with connect(url, additional_headers=headers, compression=None, proxy=None) as socket:
        socket.send(json.dumps(CALL))
        while True:
            message: dict[str, Any] = json.loads(socket.recv(20.0))
            if message["op"] == "service_response":
                return message


@pytest.mark.process
def test_token_that_is_printed_steps_the_world_and_other_clients_do_not() -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "teleop", "scenario", "host", "corridor", "--at", "middle"],
        stdout=subprocess.PIPE,
        text=True,
    ) as host:
        assert host.stdout is not None
        try:
            robot = json.loads(host.stdout.readline())
            by_referee, by_client = answer(robot["url"], robot["token"]), answer(robot["url"])
        finally:
            host.send_signal(signal.SIGTERM)
            status = host.wait(20.0)
    assert status == 0
    assert by_referee["result"] is True
    assert by_referee["values"]["result"]["result"] == 1
    assert by_client["result"] is False
    assert "referee" in by_client["values"]


@pytest.mark.long
@pytest.mark.process
@pytest.mark.slow
def test_camera_of_a_hosted_robot_publishes_pictures_of_the_ticks_that_are_stepped() -> None:
    robot = RobotProcess(
        robot_document("corridor", seed=0, start={}, truth=False), "lockstep", camera="small"
    )
    try:
        assert robot.notes == ()
        with connect(robot.url, compression=None, proxy=None, max_size=None) as socket:
            topic = "/camera/rgb/image_raw/compressed"
            socket.send(json.dumps({"op": "subscribe", "topic": topic}))
            socket.send(json.dumps({"op": "call_service", "id": "1", "service": "/teleop/session"}))
            while json.loads(socket.recv(20.0))["op"] != "service_response":
                pass  # the subscription stands once the call behind it is answered
            robot.step(10)
            stamps = [json.loads(socket.recv(20.0))["msg"]["header"]["stamp"] for _ in range(3)]
    finally:
        robot.stop()
    assert [stamp["nanosec"] for stamp in stamps] == [80_000_000, 140_000_000, 200_000_000]


@pytest.mark.process
@pytest.mark.slow
def test_hosted_robot_is_refused_an_unknown_camera_with_the_names_of_those_there_are() -> None:
    with pytest.raises(RobotError, match=r"kinetc.*kinect"):
        RobotProcess(
            robot_document("corridor", seed=0, start={}, truth=False), "lockstep", camera="kinetc"
        )
