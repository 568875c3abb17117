"""The bridge between a robot's server and boards behind pseudo-terminals."""

from __future__ import annotations

import asyncio
import contextlib
import os
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.board_port import BoardPort, run_board
from robot_sim.arm.servo_board import ServoBoard
from teleop.bridges.servos.bridge import ARRAY, JOINT_DEGREES, MIRROR_DEGREES, run_servo_bridge
from teleop.bridges.servos.bridge_config import ServoBridgeConfig
from teleop.bridges.servos.servo_lines import joint_line
from teleop.ros_types import registry
from teleop.rosbridge import Client, Protocol, Server
from teleop.rosbridge.errors import ClientError
from tests.teleop.bridges.support import until
from tests.teleop.support import in_a_loop

TABLE = load_arm()
READY = [*np.degrees(TABLE.poses["ready"]).tolist(), 90.0]
STOW = [*np.degrees(TABLE.poses["stow"]).tolist(), 0.0]


@contextmanager
def plugged_in(board: ServoBoard, link: Path) -> Iterator[BoardPort]:
    """Run a board in real time behind a port."""
    ended = threading.Event()
    with BoardPort(link) as port:
        thread = threading.Thread(
            target=run_board, args=(board, port, time.monotonic_ns, ended.is_set)
        )
        thread.start()
        try:
            yield port
        finally:
            ended.set()
            thread.join()


@dataclass
class Robot:
    """A robot's server, which sends a pose again and again and keeps what comes back."""

    server: Server
    pose: list[float] = field(default_factory=lambda: STOW)
    period: float = 0.02
    mirrored: list[dict[str, Any]] = field(default_factory=list)

    async def publish(self) -> None:
        while True:
            self.server.protocol.topics.publish(
                JOINT_DEGREES, {"data": np.array(self.pose)}, self.server.now
            )
            await asyncio.sleep(self.period)

    @property
    def angles(self) -> np.ndarray:
        return np.array(self.mirrored[-1]["data"]) if self.mirrored else np.full(6, np.inf)

    def mirrors(self, pose: list[float]) -> bool:
        # Rounding 0.5, dead band 0.97, a step of the converter 0.36 degrees.
        return bool(np.all(np.abs(self.angles - pose) < 1.9))


@asynccontextmanager
async def robot(port: int = 0) -> AsyncIterator[Robot]:
    async with Server(Protocol(registry()), port=port) as server:
        made = Robot(server)
        server.protocol.topics.advertise(JOINT_DEGREES, ARRAY)
        async with Client(server.url) as client:
            await client.subscribe(MIRROR_DEGREES, ARRAY, made.mirrored.append)
            task = asyncio.create_task(made.publish())
            yield made
            task.cancel()


@asynccontextmanager
async def bridge(url: str, port: Path) -> AsyncIterator[list[str]]:
    said: list[str] = []
    task = asyncio.create_task(run_servo_bridge(ServoBridgeConfig(url, port), said.append))
    try:
        yield said
    finally:
        assert not task.done(), task.exception()
        task.cancel()
        await asyncio.wait([task])


@asynccontextmanager
async def mirroring(board: ServoBoard, folder: Path) -> AsyncIterator[tuple[Robot, list[str]]]:
    """Run a board, a robot and the bridge between them; yield once the board has the robot's pose."""
    with plugged_in(board, folder / "board"):
        async with robot() as made, bridge(made.server.url, folder / "board") as said:
            await until(lambda: made.mirrors(STOW))
            yield made, said


def says(said: list[str], text: str) -> Callable[[], bool]:
    return lambda: any(text in line for line in said)


@pytest.mark.parametrize(
    ("feedback", "label", "how"),
    [(True, "measured", "measured by feedback wires"), (False, "written", "as it writes them")],
)
@in_a_loop
async def test_a_board_takes_the_pose_of_the_robot_and_its_angles_come_back_with_their_source(
    tmp_path: Path, feedback: bool, label: str, how: str
) -> None:
    board = ServoBoard(TABLE, feedback=feedback)
    async with mirroring(board, tmp_path) as (made, said):
        made.period = 0.001  # a flood neither delays nor garbles the newest pose
        made.pose = READY
        await until(lambda: made.mirrors(READY))
        assert made.mirrored[-1]["layout"]["dim"][0]["label"] == label
        assert any(how in line for line in said)
        assert not any("refused" in line for line in said), said
    # What is written is ahead of the servos.
    assert not feedback or np.degrees(board.angles) == pytest.approx(READY[:5], abs=2.0)


@pytest.mark.slow
@in_a_loop
async def test_a_board_that_is_unplugged_in_mid_line_is_found_again(tmp_path: Path) -> None:
    link = tmp_path / "board"
    board = ServoBoard(TABLE)
    async with robot() as made, bridge(made.server.url, link) as said:
        await until(says(said, "there is no such device"), said)
        with plugged_in(board, link):
            await until(lambda: made.mirrors(STOW))
            await until(lambda: board.waiting > 0)
        await until(says(said, "lost the board"), said)
        count = len(made.mirrored)
        made.pose = READY
        await asyncio.sleep(0.2)
        assert len(made.mirrored) <= count + 2
        board.reset()  # it had no power
        with plugged_in(board, link):
            await until(lambda: made.mirrors(READY))
    assert not any("refused" in line for line in said), said


@in_a_loop
async def test_a_board_that_is_reset_goes_on_by_itself(tmp_path: Path) -> None:
    board = ServoBoard(TABLE)
    async with mirroring(board, tmp_path) as (made, said):
        said.clear()
        board.reset()
        made.pose = READY
        await until(lambda: made.mirrors(READY))
        await until(says(said, "the board has started"), said)


@pytest.mark.slow
@in_a_loop
async def test_garbage_from_a_board_is_dropped_and_said(tmp_path: Path) -> None:
    with plugged_in(ServoBoard(TABLE), tmp_path / "board") as port:
        async with robot() as made, bridge(made.server.url, tmp_path / "board") as said:
            await until(lambda: made.mirrors(STOW))
            for _ in range(20):
                port.write(b"\xff\n\nA 1.0 2.0\nhello" + bytes(range(256)))
                await asyncio.sleep(0.01)
            await until(says(said, "were cut or garbled"), said)
            count = len(made.mirrored)
            await until(lambda: len(made.mirrored) > count + 5)
            assert all(np.all(np.abs(np.array(m["data"]) - STOW) < 1.9) for m in made.mirrored)


@pytest.mark.slow
@in_a_loop
async def test_two_bridges_do_not_share_a_board(tmp_path: Path) -> None:
    link = tmp_path / "board"
    board = ServoBoard(TABLE)
    with plugged_in(board, link):
        async with robot() as made:
            async with bridge(made.server.url, link):
                await until(lambda: made.mirrors(STOW))
                async with bridge(made.server.url, link) as said:
                    await until(says(said, "another program has it open"), said)
                    made.pose = READY
                    await until(lambda: made.mirrors(READY))
            async with bridge(made.server.url, link):
                made.pose = STOW
                await until(lambda: made.mirrors(STOW))


@in_a_loop
async def test_a_file_that_is_no_port_is_named(tmp_path: Path) -> None:
    (tmp_path / "board").write_text("a sketch, not a device")
    async with bridge("ws://127.0.0.1:1", tmp_path / "board") as said:
        await until(says(said, f"no board at {tmp_path / 'board'}: it is no serial port;"), said)


@pytest.mark.slow
@in_a_loop
async def test_a_board_that_takes_nothing_stops_nothing_else(tmp_path: Path) -> None:
    with BoardPort(tmp_path / "board") as port:
        end = os.open(port.name, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(end, b"x" * 1000)
        async with robot() as made, bridge(made.server.url, tmp_path / "board") as said:
            await until(says(said, "does it run the sketch?"), said)
            taken = bytearray()

            def has_a_line() -> bool:
                taken.extend(port.read(1_000_000, 0.0))
                return joint_line(STOW) in taken

            await until(has_a_line, taken)
        os.close(end)


@in_a_loop
async def test_values_that_are_no_pose_are_not_sent(tmp_path: Path) -> None:
    board = ServoBoard(TABLE)
    with plugged_in(board, tmp_path / "board"):
        async with robot() as made, bridge(made.server.url, tmp_path / "board") as said:
            made.pose = [0.0, 1.0]
            await until(says(said, "/arm/joint_degrees: a board takes 6 angles"), said)
            assert board.firmware.written is None
            made.pose = [500.0, *STOW[1:]]
            await until(says(said, "because of its range 1"), said)
            assert board.firmware.written is None
            made.pose = STOW
            await until(lambda: made.mirrors(STOW))


@pytest.mark.slow
@in_a_loop
async def test_a_robot_that_is_lost_leaves_the_board_where_it_is_until_it_is_back(
    tmp_path: Path,
) -> None:
    board = ServoBoard(TABLE)
    with plugged_in(board, tmp_path / "board"):
        async with robot() as made:
            port = made.server.port
            running = bridge(made.server.url, tmp_path / "board")
            said = await running.__aenter__()
            made.pose = READY
            await until(lambda: made.mirrors(READY))
        await until(says(said, f"lost ws://127.0.0.1:{port}"), said)
        there = board.angles.copy()
        async with robot(port) as again:
            assert np.array_equal(board.angles, there)
            await until(lambda: again.mirrors(STOW))
            await running.__aexit__(None, None, None)


@in_a_loop
async def test_an_address_that_is_no_robots_ends_the_bridge(tmp_path: Path) -> None:
    config = ServoBridgeConfig("http://127.0.0.1", tmp_path / "board")
    with pytest.raises(ClientError):
        await run_servo_bridge(config, lambda text: None)
