"""A session of the operator: connects, drives from keys and gamepads, and watches the link."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import sys
from collections.abc import Callable, Coroutine, Mapping
from typing import Any, Final

from localization.types import Pose
from teleop.operator.controls.gamepad import Gamepad, PadChanged, PadSource
from teleop.operator.controls.joy_stream import JoyStream
from teleop.operator.controls.key_events import Key, KeyEvent, TerminalReport
from teleop.operator.controls.keyboard import CAREFUL, Keyboard
from teleop.operator.display.threaded_display import LiveDisplayProtocol
from teleop.operator.hint_desk import HintDesk
from teleop.operator.map_download import MapLibrary
from teleop.operator.operating_data import gears, key_actions
from teleop.operator.operator_client import OperatorClient
from teleop.operator.robot_state.event_list import EventList
from teleop.operator.robot_state.station_view import StationView
from teleop.operator.terminal.hint_prompt import HintPrompt
from teleop.operator.terminal.terminal import Terminal, key_terminal
from teleop.operator.terminal.terminal_panel import Panel, panel_lines
from teleop.rosbridge.client.reconnecting_connection import ConnectionState
from teleop.rosbridge.errors import ServiceCallError

PERIOD: Final = 0.05
"""Period of Joy messages while a key is held [s]: twice the rate of ROS#."""
_PULSE: Final = 2
"""Number of periods between two looks at the age of what is shown: 0.1 s."""
_ASK: Final = 5
"""Number of periods between two measurements of the round trip: 0.25 s."""
_FIRST: Final = 2.0
"""Time to wait for the robot's clock before a hint is sent [s]; one in lockstep may stand still."""
_QUESTION: Final = "/rosapi/get_time"
"""Service that measures the round trip; every rosbridge server answers, if only that it has none."""

_SERVICES: Final[Mapping[str, str]] = {
    "estop": "/teleop/estop",
    "reset": "/teleop/estop_reset",
    "take_over": "/teleop/take_over",
    "find": "/localization/relocalize",
    "undo": "/localization/undo",
}
"""Services by action."""


class OperatorSession:
    """Owns keys, gamepads and the view of the robot; runs until the user or ``end`` ends it."""

    def __init__(
        self,
        operator: OperatorClient,
        *,
        clock: Callable[[], int],
        events: EventList,
        display: LiveDisplayProtocol | None = None,
        maps: MapLibrary | None = None,
        places: Mapping[str, Pose] | None = None,
        pads: PadSource | None = None,
    ) -> None:
        """Prepare a session.

        Args:
            operator: The operator's client, not yet connected.
            clock: Returns the reading of a clock that never goes back [ns].
            events: Events for the user.
            display: Display that shows what is stale.
            maps: Where the robot's map comes from; None to show none.
            places: Places for hints; those of the scene that the map is named after by default.
            pads: Gamepads.
        """
        self._operator, self._clock = operator, clock
        self._display, self._maps = display, maps
        self.events = events
        self.view = StationView(events)
        self.hints = HintDesk(operator, events, places)
        """Sends hints, and reports the verdicts on them."""
        self._keyboard, self._joy = Keyboard(), JoyStream()
        self._pads, self._gamepad = pads, Gamepad()
        self._prompt: HintPrompt | None = None
        self._quitting, self._help = False, True
        self._map_wanted, self._map_failed = "", False
        self._stop, self._clock_received = asyncio.Event(), asyncio.Event()
        # References to running tasks; asyncio itself keeps only weak ones.
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def ended(self) -> bool:
        """Whether the session has been ended, by the user or by ``end``."""
        return self._stop.is_set()

    def end(self) -> None:
        """End the session soon."""
        self._stop.set()

    def receive(self, topic: str, message: Mapping[str, Any]) -> None:
        """Take a message of the robot."""
        estop = self.view.reported.estop
        anew = self.view.received(topic, message, self._clock())
        if self.view.reported.estop is not None and estop is None:
            # A key that is held down must not drive off when the e-stop is released.
            self._keyboard.block(self._clock())
            self._gamepad.block()
        if anew:
            self.hints.restart()
        if topic == "/clock":
            self._clock_received.set()
            self.hints.clock_received()
        if topic == "/localization/hint_verdict":
            self.hints.judge(message)

    async def run(
        self,
        *,
        connection_changed: Callable[[ConnectionState], None] = lambda state: None,
        hint: Pose | None = None,
        find: bool = False,
    ) -> None:
        """Connect and drive; a lost connection is re-established.

        Args:
            connection_changed: Called with each state of the connection, once it was established.
            hint: Pose to send as a hint, once connected.
            find: Whether to have the robot search the whole map, once connected.

        Raises:
            ClientError: If the first connection fails.
        """
        loop, client = asyncio.get_running_loop(), self._operator.client
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
                loop.add_signal_handler(number, self._stop.set)
        connected = asyncio.Event()

        def status(level: str, text: str) -> None:
            # Before the server is known to be a rosbridge server, its statuses mean nothing.
            if connected.is_set():
                self._joy.refused(text)
                self.events.add(f"{level}: {text}")

        def changed(state: ConnectionState) -> None:
            up = state is ConnectionState.CONNECTED
            if state is not ConnectionState.CLOSED and not self.ended:
                reason = client.url if up else client.closed_reason
                self.view.connection(up, reason, self._clock())
                if self._map_failed:
                    self._map_wanted = ""
            connection_changed(state)

        client.on_status(status)
        await client.connect()
        connected.set()
        client.on_connection(changed)
        changed(ConnectionState.CONNECTED)
        await self._operator.start()
        with key_terminal() as terminal:
            if terminal is not None:
                self._keyboard.reports_releases = terminal.reports_releases
                if not terminal.reports_releases:
                    self._keyboard.shift(CAREFUL)
                loop.add_reader(terminal.keys, self._take_input, terminal)
            try:
                self._spawn(self._begin(hint, find))
                await self._drive(terminal)
            finally:
                if terminal is not None:
                    loop.remove_reader(terminal.keys)
                for task in list(self._tasks):
                    task.cancel()
                await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _begin(self, hint: Pose | None, find: bool) -> None:
        """Send what was asked for on the command line."""
        if hint is not None:
            # The robot repeats its last verdict; only one that is newer than the hint can be the answer.
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._clock_received.wait(), _FIRST)
            await self.hints.send(hint, asked=True)
        if find:
            await self._call(_SERVICES["find"])

    async def _drive(self, terminal: Terminal | None) -> None:
        """Send Joy messages while something is held, and look after link and screen."""
        panel = None if terminal is None else Panel(terminal, encoding=sys.stdout.encoding)
        period = 0
        try:
            while not self._stop.is_set():
                await self._send_joy()
                if period % _PULSE == 0:
                    self._pulse(terminal, panel)
                if period % _ASK == 0 and self.view.unanswered(self._clock()) == 0:
                    self._spawn(self._measure())
                period += 1
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._stop.wait(), PERIOD)
            self._keyboard.release_all()
            self._gamepad.block()
            await self._send_joy()
        finally:
            if panel is not None:
                panel.close()

    async def _send_joy(self) -> None:
        """Send the Joy message that is due, if any."""
        now = self._clock()
        if self._pads is not None:
            for event in self._pads.poll():
                if isinstance(event, PadChanged):
                    what = f"gamepad {event.name}" if event.present else "gamepad unplugged"
                    self.events.add(f"{what}: neutral")
                if (action := self._gamepad.take(event)) is not None:
                    self._act(action)
        twist, held = self._gamepad.twist(self._keyboard.gear)
        if not held:
            twist, held = self._keyboard.twist(now)
        due = self._joy.next(twist, held, disarmed=self.view.control == "disarmed")
        if due is not None and self._operator.client.connected:
            await self._operator.drive(due[0], enabled=due[1])

    def _pulse(self, terminal: Terminal | None, panel: Panel | None) -> None:
        """Look at the age of everything, and show it."""
        now, operator = self._clock(), self._operator
        if self._display is not None:
            self._display.pulse(self.view.pulse(now))
        if self._maps is not None and operator.map_sha256 not in ("", self._map_wanted):
            self._map_wanted = operator.map_sha256
            self._spawn(self._fetch_map(self._maps, operator.map_sha256))
        if terminal is None or panel is None:
            return
        if self._keyboard.reports_releases:
            terminal.ask_alive()
        for alone in terminal.decoder.idle():
            if isinstance(alone, Key):
                self._take_key(alone)
        lines = panel_lines(
            self.view,
            self._keyboard,
            now,
            title=f"farsteer operate {operator.client.url}",
            pads=self._gamepad.names,
            prompt=self._prompt,
            help_shown=self._help,
            size=panel.size,
        )
        panel.show(lines)

    async def _measure(self) -> None:
        """Measure the round trip; a server that does not answer keeps the question open."""
        self.view.asked(self._clock())
        try:
            await self._operator.client.call(_QUESTION, timeout=float("inf"))
        except ServiceCallError:
            if not self._operator.client.connected:
                return
        self.view.answered(self._clock())

    async def _fetch_map(self, maps: MapLibrary, sha256: str) -> None:
        """Get the robot's map and show it."""
        from localization.errors import LocalizationError
        from teleop.errors import TeleopError

        name = self._operator.map_name
        self.view.map = f"map {name} ({sha256[:12]}) is being fetched"
        self._map_failed = False
        try:
            cloud, where = await maps.load(sha256)
        except (LocalizationError, TeleopError, OSError) as error:
            self._map_failed = True  # the next connection tries again
            self.view.map = f"no map is shown: {error}"
            self.events.add(self.view.map)
            return
        self.view.map = f"map {name} ({sha256[:12]}), {where}"
        self.events.add(f"{self.view.map}: {len(cloud.points)} points")
        if self._display is not None and self._operator.map_sha256 == cloud.sha256:
            self._display.map(cloud)

    def _take_input(self, terminal: Terminal) -> None:
        now = self._clock()
        try:
            inputs = terminal.read()
        except EOFError:
            asyncio.get_running_loop().remove_reader(terminal.keys)
            self._keyboard.release_all()
            self.end()
            return
        for event in inputs:
            if isinstance(event, Key):
                self._take_key(event)
            elif event is TerminalReport.ALIVE:
                self._keyboard.answered(now)
            elif event is TerminalReport.FOCUS_LOST:
                # The release of a key goes to the window that has the keyboard then.
                self._keyboard.release_all()

    def _take_key(self, key: Key) -> None:
        """Take a key: an answer to an open question, a drive key, or an action."""
        action = key_actions().get(key.name)
        if self._prompt is not None and action not in ("estop", "end"):
            if key.event is not KeyEvent.RELEASE:
                self._answer(self._prompt.after(key.name))
            return
        if self._keyboard.take(key, self._clock()):
            self._quitting = False
            return
        if action is not None and key.event is KeyEvent.PRESS:
            self._act(action)

    def _act(self, action: str) -> None:
        """Do what a key or a button is for."""
        quitting, self._quitting = self._quitting, action == "quit"
        match action:
            case "end":
                self.end()
            case "quit" if quitting:
                self.end()
            case "quit":
                self.events.add("press q again to end")
            case "stop":
                self._keyboard.release_all()
            case "faster" | "slower":
                self._keyboard.shift(self._keyboard.gear + (1 if action == "faster" else -1))
            case _ if action in (names := [gear.action for gear in gears()]):
                self._keyboard.shift(names.index(action))
            case "help":
                self._help = not self._help
            case "place" | "numbers":
                self._keyboard.release_all()
                self._prompt = HintPrompt(self.hints.menu() if action == "place" else {})
            case _:
                if action == "estop":
                    self._keyboard.block(self._clock())
                    self._gamepad.block()
                self._spawn(self._call(_SERVICES[action]))

    def _answer(self, prompt: HintPrompt) -> None:
        self._prompt = None if prompt.done else prompt
        if prompt.answer is not None:
            self._spawn(self.hints.send(prompt.answer))

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _call(self, service: str) -> None:
        try:
            answer: Mapping[str, Any] = await self._operator.client.call(service, {}, timeout=2.0)
            self.events.add(f"{service}: {answer['message']}")
        except ServiceCallError as error:
            self.events.add(f"{error}")
