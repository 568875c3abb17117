"""What ``farsteer serve`` says as it happens: who came, drove and left, and why the robot stopped."""

from __future__ import annotations

import logging
import sys
from typing import Final

from teleop.robot.safety.control_state import ControlMode, ControlState
from teleop.robot.tick_record import DriveRecord
from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer

_LOG: Final = logging.getLogger(__name__)

_MINUTE: Final = 60_000_000_000
"""A minute [ns]."""


def configure_logging(level: str) -> None:
    """Write the messages of all our loggers to the terminal, a line each, from a level on."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s", "%H:%M:%S"))
    root = logging.getLogger("teleop")
    root.handlers[:] = [handler]
    root.setLevel(level.upper())
    root.propagate = False


class ActivityLog(Observer):
    """Writes a line for each change; owns the last states of the command path and the arm."""

    def __init__(self) -> None:
        self._last: ControlState | None = None
        self._arm: tuple[str, str] | None = None
        self._guesses = 0
        self._guesses_logged: int | None = None

    def connected(self, connection: Connection, now: int) -> None:
        """Say who came."""
        _LOG.info("%s connected%s", connection.name, _role(connection.access))

    def disconnected(self, connection: Connection, now: int) -> None:
        """Say who left."""
        _LOG.info("%s left", connection.name)

    def renamed(self, connection: Connection, old: str) -> None:
        """Say who is called what."""
        _LOG.info("%s is %s", connection.number_and_address, connection.name)

    def authenticated(self, connection: Connection, access: Access | None, now: int) -> None:
        """Say who showed which token, or none that is known."""
        if access is None:
            _LOG.warning("%s showed a token that is not known", connection.name)
        else:
            _LOG.info("%s authenticated%s", connection.name, _role(access))

    def guessed(self, host: str, now: int) -> None:
        """Report wrong tokens, once a minute."""
        self._guesses += 1
        if self._guesses_logged is None or now - self._guesses_logged >= _MINUTE:
            self._guesses_logged = now
            _LOG.warning("wrong tokens: %d so far, the last from %s", self._guesses, host)

    def driven(self, tick: DriveRecord) -> None:
        """Say who took the lease, set off, or was stopped, and who moves the arm."""
        self._arm_driven(tick)
        state, last = tick.control, self._last
        self._last = state
        if last is None:
            return
        if state.asking is not None and last.asking is None:
            _LOG.info("%s asks for the robot", state.asking.client)
        if state.estop is not None and last.estop is None:
            _LOG.warning("e-stop by %s", state.estop.holder or state.estop.client)
        elif state.estop is None and last.estop is not None:
            _LOG.warning(state.reason)
        elif state.controller != last.controller and state.control is not ControlMode.ARMED:
            _LOG.info(state.reason)
        elif state.control is not last.control:
            armed = state.control is ControlMode.ARMED
            _LOG.info("%s: %s", state.controller, "drives" if armed else f"stopped, {state.reason}")

    def _arm_driven(self, tick: DriveRecord) -> None:
        """Say who moves the arm, and why it was stopped."""
        arm, last = tick.arm, self._arm
        self._arm = None if arm is None else (arm.controller, arm.mode.value)
        if arm is None or last is None or self._arm == last:
            return
        if arm.controller:
            _LOG.info("%s moves the arm: %s", arm.controller, arm.mode.value)
        elif arm.mode.value == "held":
            _LOG.info("the arm is held: %s", arm.reason)


def _role(access: Access | None) -> str:
    if access is None:
        return ", not authenticated yet"
    return f" as {access.holder}, {access.role}" if access.holder else ""
