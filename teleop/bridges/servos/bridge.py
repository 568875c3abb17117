"""The bridge as a whole: a robot with an arm on one side, a board of servos on the other."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, Final

from teleop.bridges.endless import endless
from teleop.bridges.robot_client import connect, robot_client
from teleop.bridges.seldom import Seldom
from teleop.bridges.servos.bridge_config import ServoBridgeConfig
from teleop.bridges.servos.serial_board import SerialBoard
from teleop.bridges.servos.servo_lines import Angles, Answer, Refusal, joint_line
from teleop.rosbridge import Client

JOINT_DEGREES: Final = "/arm/joint_degrees"
MIRROR_DEGREES: Final = "/arm/mirror_degrees"
ARRAY: Final = "std_msgs/Float64MultiArray"

SILENCE: Final = 2.0
"""Time after which a board that is sent lines and answers none is said to be silent [s]; an Uno starts within it."""

Say = Callable[[str], object]
"""Takes a line for the user."""


class ServoBridge:
    """Passes angles to a board, and its own back. Owns the newest of them, and what has been said."""

    def __init__(self, config: ServoBridgeConfig, client: Client, say: Say) -> None:
        """Take a client that is not connected yet."""
        self._client = client
        self._say = say
        self._board = SerialBoard(config.port, config.baud, self._take_answer, say)
        self._angles: Angles | None = None
        self._fresh = asyncio.Event()
        self._measured: bool | None = None
        self._refusals, self._faults, self._unreadable = Seldom(), Seldom(), Seldom()
        self._sent = self._answered = False

    async def run(self) -> None:
        """Pass angles in both directions without end.

        Raises:
            ClientError: If the address is no robot's, or does not accept the token.
        """
        await self._client.subscribe(JOINT_DEGREES, ARRAY, self._take_joints, queue_length=1)
        await self._client.advertise(MIRROR_DEGREES, ARRAY)
        parts = {
            "board": self._board.run(),
            "sender of angles": self._publish(),
            "listener for silence": self._mind_silence(),
        }
        async with asyncio.TaskGroup() as group:
            group.create_task(connect(self._client, self._say))
            for name, part in parts.items():
                group.create_task(endless(name, part))

    def _take_joints(self, message: dict[str, Any]) -> None:
        try:
            line = joint_line(message["data"])
        except ValueError as error:
            self._faults.say(self._say, f"{JOINT_DEGREES}: {error}; not sent")
            return
        self._sent = True
        self._board.send(line)

    def _take_answer(self, answer: Answer) -> None:
        self._answered = True
        match answer:
            case Angles():
                self._angles = answer
                self._fresh.set()
                if answer.measured is not self._measured:
                    self._measured = answer.measured
                    how = "measured by feedback wires" if answer.measured else "as it writes them"
                    self._say(f"the board sends angles, {how}")
            case Refusal(reason, count):
                text = f"the board has refused {count} lines, the last because of its {reason}"
                self._refusals.say(self._say, text)
            case _:
                self._measured = None
                self._say("the board has started")

    async def _publish(self) -> None:
        while True:
            await self._fresh.wait()
            self._fresh.clear()
            if (angles := self._angles) is not None:
                # The label says it, for the type has no other place.
                label = "measured" if angles.measured else "written"
                size = len(angles.degrees)
                dimension = {"label": label, "size": size, "stride": size}
                layout = {"dim": [dimension], "data_offset": 0}
                message = {"layout": layout, "data": list(angles.degrees)}
                await self._client.publish(MIRROR_DEGREES, message)

    async def _mind_silence(self) -> None:
        silent, unreadable = False, 0
        while True:
            self._sent = self._answered = False
            await asyncio.sleep(SILENCE)
            if self._board.unreadable > unreadable:
                unreadable = self._board.unreadable
                text = f"{unreadable} lines from the board were cut or garbled"
                self._unreadable.say(self._say, text)
            now = self._board.is_open and self._sent and not self._answered
            if now and not silent:
                self._say(f"the board has not answered for {SILENCE:g} s: does it run the sketch?")
            silent = now


async def run_servo_bridge(config: ServoBridgeConfig, say: Say) -> None:
    """Run a bridge until it is cancelled.

    Raises:
        SettingError: If the token or the certificate cannot be read.
        ClientError: If the robot's address is no robot's, or it does not accept the token.
        PartEndedError: If a part of the bridge has ended without an error.
    """
    async with robot_client(config.robot, config.token_file, config.ca, say) as client:
        await ServoBridge(config, client, say).run()
