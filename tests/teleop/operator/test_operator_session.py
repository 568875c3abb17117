"""``farsteer operate`` as a person uses it: a real pseudo terminal, a real socket, a robot in lockstep."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from functools import partial
from pathlib import Path

import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.operator.controls.gamepad import (
    DEADMAN,
    ButtonChanged,
    PadChanged,
    PadEvent,
    StickMoved,
)
from teleop.operator.controls.key_events import KeyDecoder
from teleop.operator.controls.keyboard import Keyboard
from teleop.operator.operator_client import OperatorClient
from teleop.operator.operator_session import OperatorSession
from teleop.operator.robot_state.event_list import EventList
from teleop.operator.robot_state.station_view import StationView
from teleop.operator.terminal.terminal import RESTORE_KEYS, Terminal
from teleop.operator.terminal.terminal_panel import Panel, panel_lines
from teleop.robot.safety.control_state import ControlMode
from teleop.ros_types import registry
from teleop.rosbridge import Client
from tests.teleop.operator.emulator import KITTY, XTERM, Emulator, emulator
from tests.teleop.support import (
    ROOT,
    Peer,
    Rig,
    Robots,
    command,
    hint_message,
    in_a_loop,
    lockstep,
    peer,
    real_time,
    soon,
)

pytestmark = pytest.mark.process

_W, _W_UP = b"w", b"\x1b[119;1:3u"


@pytest.fixture
def robots(office: World, office_cloud: Cloud, cache: Path) -> Robots:
    """Return a function that serves a robot in the office; use its result in ``async with``."""
    return partial(lockstep, office, office_cloud, cache)


@pytest.fixture
def home(cache: Path) -> dict[str, str]:
    """An environment whose cached maps are those of the tests."""
    return {**os.environ, "XDG_CACHE_HOME": str(cache.parent)}


class Station:
    """A running ``farsteer operate`` in a terminal, beside a robot that another client steps."""

    def __init__(self, terminal: Emulator, stepper: Peer, process: subprocess.Popen[bytes]) -> None:
        self.terminal, self.robot, self.process = terminal, stepper, process

    async def until(self, true: Callable[[], object], what: str) -> None:
        """Step the robot until something holds; the station runs meanwhile."""
        for _ in range(1500):
            await self.robot.step(1)
            if true():
                return
            assert self.process.poll() is None, self.terminal.seen[-2000:]
            await asyncio.sleep(0.01)
        raise AssertionError(f"never {what}: {self.terminal.seen[-3000:]!r}")

    async def shows(self, text: str) -> None:
        """Step the robot until the terminal was sent a text."""
        await self.until(lambda: text.encode() in self.terminal.seen, f"shown: {text}")

    def mode(self, state: ControlMode) -> Callable[[], bool]:
        """Return whether the robot is in a state."""
        return lambda: (
            bool(self.robot.messages("/teleop/state"))
            and (self.robot.last("/teleop/state")["state"] == state)
        )


@contextmanager
def _running(
    terminal: Emulator, url: str, home: dict[str, str], options: tuple[str, ...]
) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen(
        [sys.executable, "-m", "teleop", "operate", url, "--no-viewer", *options],
        stdin=terminal.slave,
        stdout=terminal.slave,
        stderr=subprocess.PIPE,
        cwd=ROOT,
        env=home,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@asynccontextmanager
async def station(
    robots: Robots, home: dict[str, str], answers: dict[bytes, bytes], *options: str
) -> AsyncIterator[tuple[Station, Rig]]:
    """Operate a robot from a terminal."""
    async with robots() as rig, peer(rig.server.url) as stepper:
        await stepper.subscribe("/teleop/state", "/ground_truth/odom", "/localization/hint_verdict")
        with (
            emulator(answers) as terminal,
            _running(terminal, rig.server.url, home, options) as process,
        ):
            operated = Station(terminal, stepper, process)
            # No time passes on the robot before: it would search for itself.
            while len(rig.server.protocol.connections) < 2:
                assert process.poll() is None
                await asyncio.sleep(0.01)
            await operated.shows("Link: good")
            yield operated, rig


@in_a_loop
async def test_key_drives_until_its_release_is_reported(
    robots: Robots, home: dict[str, str]
) -> None:
    async with station(robots, home, KITTY) as (operated, _):
        operated.terminal.type(_W)
        await operated.until(lambda: operated.robot.speed > 0.3, "driving")
        operated.terminal.type(_W_UP)
        await operated.until(lambda: abs(operated.robot.speed) < 0.01, "at rest")
        # The release is a Joy without the deadman, not a watchdog that runs out.
        assert operated.robot.last("/teleop/state")["state"] == ControlMode.ARMED
        operated.terminal.type(b"\x1b[99;5u")
        await asyncio.to_thread(operated.process.wait, 60)
        assert operated.process.returncode == 0
        operated.terminal.wait_for(RESTORE_KEYS)


@in_a_loop
async def test_held_key_drives_again_after_a_take_over_without_being_released(
    robots: Robots, home: dict[str, str]
) -> None:
    async with station(robots, home, KITTY) as (operated, _):
        operated.terminal.type(_W)
        await operated.until(lambda: operated.robot.speed > 0.3, "driving")
        assert (await operated.robot.ask("/teleop/take_over"))[0]
        await operated.until(lambda: abs(operated.robot.speed) < 0.01, "at rest")
        # A driver who takes over must show a neutral stick: the station does, while the key stays down.
        operated.terminal.type(b"t")
        await operated.until(lambda: operated.robot.speed > 0.3, "driving again")


@in_a_loop
async def test_key_held_through_an_e_stop_does_not_drive_when_it_is_released(
    robots: Robots, home: dict[str, str]
) -> None:
    async with station(robots, home, KITTY) as (operated, _):
        operated.terminal.type(_W)
        await operated.until(lambda: operated.robot.speed > 0.3, "driving")
        operated.terminal.type(b"e")
        await operated.until(operated.mode(ControlMode.ESTOP), "stopped")
        await operated.shows("E-stop (pressed by")
        operated.terminal.type(b"\x1b[119;1:2u")  # it still repeats
        operated.terminal.type(b"p")
        await operated.until(operated.mode(ControlMode.IDLE), "released")
        for _ in range(20):
            operated.terminal.type(b"\x1b[119;1:2u")
            await operated.robot.step(2)
            await asyncio.sleep(0.01)
        assert abs(operated.robot.speed) < 0.01
        operated.terminal.type(_W_UP + _W)
        await operated.until(lambda: operated.robot.speed > 0.1, "driving anew")


@in_a_loop
async def test_hints_are_given_at_a_place_and_by_numbers_and_judged(
    robots: Robots, home: dict[str, str]
) -> None:
    async with station(robots, home, XTERM) as (operated, _):
        await operated.shows("Not placed yet")
        await operated.shows("releases are not reported here")
        operated.terminal.type(b"n")
        await operated.shows("x [m], y [m], heading [deg]")
        operated.terminal.type(b"1 1 0\n")
        await operated.shows("Hint rejected")
        # Of a robot without a pose the whole map is searched then.
        await operated.shows("Knows where it is")
        await operated.robot.step(60)  # a hint a second
        operated.terminal.type(b"h")
        await operated.shows("3 hall")
        operated.terminal.type(b"3\n")
        await operated.shows("Hint kept")
        operated.terminal.type(b"qq")
        await asyncio.to_thread(operated.process.wait, 60)
        assert operated.process.returncode == 0
        # What was on the screen stays on the terminal.
        operated.terminal.wait_for(b"Hint kept")


@in_a_loop
async def test_terminated_station_restores_the_terminal(
    robots: Robots, home: dict[str, str]
) -> None:
    async with station(robots, home, KITTY) as (operated, _):
        operated.process.terminate()
        await asyncio.to_thread(operated.process.wait, 60)
        operated.terminal.wait_for(RESTORE_KEYS)
        operated.terminal.wait_for(b"\x1b[?1049l")


@pytest.mark.long
@in_a_loop
async def test_refused_hint_is_status_1_and_an_old_verdict_is_not_its_answer(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    async with real_time(office, office_cloud, cache) as server, peer(server.url) as other:
        await other.subscribe("/localization/hint_verdict")
        await other.hint(hint_message(24.2, 3.0, 0.0, sigma=0.2))
        await other.until(lambda: other.messages("/localization/hint_verdict"), "judged")
        old = other.last("/localization/hint_verdict")["reason"]
        options = ("operate", server.url, "--no-viewer", "--duration", "5")
        status, out, err = await command(*options, "--hint", "1", "1", "0")
        assert status == 1, err
        assert out.count("Hint rejected") == 1
        assert old not in out
        status, out, err = await command(*options, "--hint", "24.2", "3", "180")
        assert status == 0, err
        assert "Hint rejected" not in out


class Pads:
    """Devices whose events a test gives; the session reads them as it reads those of pygame."""

    def __init__(self) -> None:
        self.events: list[PadEvent] = []

    def poll(self) -> list[PadEvent]:
        taken, self.events = self.events, []
        return taken

    def close(self) -> None:
        self.events.clear()


@in_a_loop
async def test_gamepad_drives_until_it_is_unplugged_and_link_loss_is_reported_in_words(
    robots: Robots,
) -> None:
    loop, pads, lost = asyncio.get_running_loop(), Pads(), asyncio.Event()
    events = EventList(lambda text: lost.set() if text.startswith("link lost") else None)
    async with AsyncExitStack() as stack:
        rig = await stack.enter_async_context(robots())
        stepper = await stack.enter_async_context(peer(rig.server.url))
        await stepper.subscribe("/teleop/state", "/ground_truth/odom")
        client = Client(rig.server.url, registry=registry())
        operator = OperatorClient(
            client, None, on_message=lambda topic, message: session.receive(topic, message)
        )
        session = OperatorSession(
            operator, clock=lambda: int(loop.time() * 1e9), events=events, pads=pads
        )
        running = asyncio.create_task(session.run())

        async def until(true: Callable[[], object]) -> None:
            for _ in range(1500):
                await stepper.step(1)
                if true():
                    return
                await asyncio.sleep(0.01)
            raise AssertionError([str(event) for event in events.last(20)])

        pads.events = [PadChanged(1, "Pad", present=True), StickMoved(1, 1, -1.0)]
        pads.events += [ButtonChanged(1, DEADMAN, pressed=True)]
        await until(lambda: stepper.messages("/ground_truth/odom") and stepper.speed > 0.3)
        pads.events = [PadChanged(1, "", present=False)]
        await until(lambda: abs(stepper.speed) < 0.01)
        assert stepper.last("/teleop/state")["reason"] == "neutral"
        pads.events = [PadChanged(1, "Pad", present=True), ButtonChanged(1, 1, pressed=True)]
        await until(lambda: stepper.last("/teleop/state")["estop"])
        await stack.aclose()
        await soon(lost.wait())
        session.end()
        await soon(running)
        await client.close()
    told = [str(event) for event in events.last(20)]
    assert "link lost: the robot's server was shut down; the robot brakes by itself" in told
    assert "gamepad unplugged: neutral" in told


@pytest.mark.parametrize("size", [(80, 24), (40, 8), (10, 3), (200, 60)])
def test_panel_fits_any_terminal_and_draws_only_what_changed(size: tuple[int, int]) -> None:
    view = StationView(EventList())
    for k in range(50):
        view.events.add(f"event {k}")
    lines = panel_lines(view, Keyboard(), 0, title="t\u00e9st", size=size)
    assert len(lines) <= size[1]
    assert max(len(text) for _, text in lines) <= size[0]
    read_end, write_end = os.pipe()
    panel = Panel(Terminal(read_end, write_end, False, KeyDecoder()), encoding="ascii")
    panel.show(lines)
    assert b"t?st" in os.read(read_end, 1 << 16)
    panel.show(lines)
    panel.show([(None, "other"), *lines[1:]])
    assert os.read(read_end, 1 << 16).count(b"\x1b[K") == 1
    os.close(read_end)
    os.close(write_end)


def test_station_needs_neither_simulator_nor_robot() -> None:
    program = """
import sys
for name in ("mujoco", "embreex", "robot_sim", "teleop.scene_clouds"):
    sys.modules[name] = None
from teleop.__main__ import main
sys.exit(main(["operate", "ws://127.0.0.1:9", "--no-viewer", "--record", sys.argv[1]]))
"""
    done = subprocess.run(
        [sys.executable, "-c", program, os.devnull], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert "no server listens at ws://127.0.0.1:9" in done.stderr
