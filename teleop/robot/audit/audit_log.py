"""Audit log of the robot: commands, hints, e-stops, connections and rejected attempts, line by line."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from localization.types import SECOND, Hint, HintVerdict
from teleop.joystick import VelocityRequest
from teleop.robot.audit.audit_rate_limit import AuditRateLimiter
from teleop.robot.audit.guess_count import GuessCount
from teleop.robot.inbox import DriveCommand
from teleop.robot.step_results import StepOutcome
from teleop.robot.tick_record import DriveRecord, EstimateRecord
from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.refusals import Refusal
from teleop.rosbridge.server.server import Server
from teleop.step_commands.commands import Step

_DIGITS: Final = 6
"""Decimals of numbers in the log: micrometres."""

_HARMLESS: Final = ("subscribe", "unsubscribe", "unadvertise", "set_level", "status")
"""Operations that change nothing; their rejection is not logged."""

_MAX_HINTS: Final = 64
"""Number of hints whose senders are remembered until the verdict."""

_TURNS: Final = ("ask", "give", "refuse")
"""Actions of clients that take turns; they share a rate."""

_MAX_VISITORS: Final = 256
"""Number of clients without a connection whose allowances are remembered."""

_PATH: Final = 80
"""Characters of a path that are logged."""

_REQUEST: Final = 600
"""Characters of a request that are logged."""

SUPPRESSED: Final = "suppressed"
"""Kind of the line that reports how many lines were suppressed."""


class AuditLog(Observer):
    """Turns events into lines; owns the last request of each client that it has logged."""

    def __init__(
        self,
        write: Callable[[dict[str, Any]], None],
        server: Server,
        *,
        stamp: Callable[[], int],
        wall: Callable[[], str],
    ) -> None:
        """Subscribe to the server's events.

        Args:
            write: Receives each line.
            server: The server whose connections are logged.
            stamp: Returns the time of the robot's clock [ns].
            wall: Returns date and time, for people.
        """
        self._write = write
        self._stamp, self._wall = stamp, wall
        self._identity: dict[str, dict[str, str]] = {}
        self._logged: dict[str, tuple[list[float], bool, str]] = {}
        self._hints: deque[tuple[list[float], str]] = deque(maxlen=_MAX_HINTS)
        self._rates = AuditRateLimiter()
        self._visitors: dict[str, None] = {}
        self._guesses, self._server = GuessCount(), server
        server.protocol.observers.add(self)

    def hint(self, client: str, hint: Hint) -> None:
        """Log a hint, with the standard deviations that its sender gave."""
        self._hints.append((_numbers(hint), client))
        pose, sigmas = hint.map_from_base, np.sqrt(np.clip(np.diag(hint.covariance), 0.0, None))
        self._line(
            "hint",
            client,
            position=_rounded(pose.position),
            orientation_wxyz=_rounded(pose.quaternion_wxyz),
            sigmas=_rounded(sigmas),
        )

    def action(self, client: str, action: str, rejection: str | None = None) -> None:
        """Log an e-stop, its reset, a take-over, an undo or a search, and why it was rejected if it was.

        A request for the robot, and the driver's answer to one, are logged as well.
        """
        kind = "turn" if action in _TURNS else action
        self._line(action, client, kind=kind, **({"refused": rejection} if rejection else {}))

    def step(self, client: str, step: Step) -> None:
        """Log a step that a client asks for."""
        self._line(
            "step",
            client,
            distance=round(step.distance, _DIGITS),
            angle=round(step.angle, _DIGITS),
            speed=round(step.speed, _DIGITS),
        )

    def photo(self, client: str, access: Access | None, photo: str, refused: str) -> None:
        """Log a photograph, or why a client got none; over HTTP a client is known by its address."""
        identity = _identity_of(access)
        if refused:
            self._line("photo", client, kind="photo refused", refused=refused, **identity)
        else:
            self._line("photo", client, photo=photo, **identity)

    def viewer_refused(self, client: str, access: Access | None, path: str, refused: str) -> None:
        """Log that somebody at an address got no pictures, and why."""
        identity = _identity_of(access)
        self._line("viewer refused", client, path=path[:_PATH], refused=refused, **identity)

    def disconnected_by(
        self, client: str, target: Connection | None, seconds: float, reason: str, refused: str
    ) -> None:
        """Log that a client has another one disconnected and barred, or why it has not."""
        whom = {} if target is None else {"whom": target.name}
        if target is not None and target.access is not None and target.access.holder:
            whom["whose"] = target.access.holder
        more = {"refused": refused} if refused else {"seconds": seconds, "reason": reason}
        self._line("disconnect", client, **whom, **more)

    def token(
        self, client: str, action: str, token: str, role: str, until: str, *, refused: str
    ) -> None:
        """Log that a client makes or ends a token, by its name, or why it does not; ``until`` is when it ends."""
        given = {"token": token, "for": role, "until": until, "refused": refused}
        more = {key: value for key, value in given.items() if value}
        self._line(action, client, kind="token", **more)

    def played(self, client: str, service: str, request: str) -> None:
        """Log that a client changes the simulated world, with the request as JSON."""
        self._line("playground", client, service=service, request=request[:_REQUEST])

    def tokens_renewed(self, disconnected: Sequence[str]) -> None:
        """Log that the token file was read again, and which clients it disconnected."""
        self._write(
            {**self._when(), "what": "tokens read again", "disconnected": list(disconnected)}
        )

    def driven(self, tick: DriveRecord) -> None:
        """Log a tick's commands: of each client the newest, if it has changed."""
        rejections = {rejection.client: rejection.reason for rejection in tick.rejections}
        newest = {m.client: m.request for m in tick.inbox if isinstance(m, DriveCommand)}
        for client, request in newest.items():
            self._command(client, request, rejections.get(client, ""))
        for result in tick.steps.ended:
            refused = result.outcome is StepOutcome.REFUSED
            self._line(
                "step ended",
                result.goal.client,
                kind="step refused" if refused else "step ended",
                outcome=result.outcome.value,
                distance=round(result.distance, _DIGITS),
                angle=round(result.angle, _DIGITS),
                **({"refused": result.message} if refused else {}),
            )

    def estimated(self, tick: EstimateRecord) -> None:
        """Log a tick's verdicts."""
        for estimate in tick.estimates:
            if estimate.verdict is not None:
                self._verdict(estimate.verdict)

    def end(self) -> None:
        """Log the numbers of suppressed lines and wrong tokens that no line has reported yet."""
        self._report_guesses()
        self._count(last=True)

    def _command(self, client: str, request: VelocityRequest, rejection: str) -> None:
        twist = [*request.twist.linear.tolist(), *request.twist.angular.tolist()]
        wish = twist, request.enabled, rejection
        if self._logged.get(client) == wish:
            return
        if client in self._identity:
            self._logged[client] = wish
        self._line(
            "drive",
            client,
            forward=round(float(request.twist.linear[0]), _DIGITS),
            turn=round(float(request.twist.angular[2]), _DIGITS),
            deadman=request.enabled,
            kind="drive refused" if rejection else "drive",
            **({"refused": rejection} if rejection else {}),
        )

    def _verdict(self, verdict: HintVerdict) -> None:
        asked = _numbers(verdict.hint)
        for hint, client in self._hints:  # the pose that the robot starts with has no sender
            if hint == asked:
                found, why = verdict.verdict.value, verdict.reason
                self._line("hint answered", client, verdict=found, reason=why)

    def refused(self, connection: Connection, refusal: Refusal) -> None:
        """Log a rejected operation."""
        if refusal.op not in _HARMLESS:
            asked = {"op": refusal.op, "name": refusal.name}
            given = {key: value for key, value in asked.items() if value}
            self._line("refused", connection.name, **given, refused=refusal.why)

    def connected(self, connection: Connection, now: int) -> None:
        """Log a connection."""
        self._identify(connection)
        self._line("connected", connection.name)

    def renamed(self, connection: Connection, old: str) -> None:
        """Log a client's name; its lines have it from now on, beside number and address."""
        self._identity.pop(old, None)
        self._identify(connection)
        self._rates.leave(old)
        self._line("named", connection.name)

    def disconnected(self, connection: Connection, now: int) -> None:
        """Log the end of a connection."""
        name = connection.name
        self._line("disconnected", name)
        self._identity.pop(name, None)
        self._logged.pop(name, None)
        self._rates.leave(name)

    def authenticated(self, connection: Connection, access: Access | None, now: int) -> None:
        """Log an authentication, or its rejection."""
        name = connection.name
        if access is None:
            self._line("auth refused", name)
        else:
            self._identify(connection)
            self._line("auth", name)

    def guessed(self, host: str, now: int) -> None:
        """Count a wrong token; one line a second logs how many there were, and from where."""
        if self._guesses.add(host):
            due = self._server.now + SECOND
            self._server.protocol.timers.at(due, lambda now: self._report_guesses())

    def _report_guesses(self) -> None:
        if counted := self._guesses.report():
            self._write({**self._when(), "what": "wrong tokens", **counted})

    def _identify(self, connection: Connection) -> None:
        name, label = connection.name, connection.number_and_address
        called = {} if name == label else {"client": label, "name": name}
        self._identity[name] = {**called, **_identity_of(connection.access)}

    def _line(self, what: str, client: str, *, kind: str = "", **more: object) -> None:
        if client not in self._identity:
            self._visit(client)
        if not self._rates.take(kind or what, client, self._stamp()):
            return
        self._count()
        identity = {"client": client, **self._identity.get(client, {})}
        self._write({**self._when(), "what": what, **identity, **more})

    def _visit(self, client: str) -> None:
        """Note a client without a connection; of those that came long ago the allowances are forgotten."""
        self._visitors.pop(client, None)
        self._visitors[client] = None
        if len(self._visitors) > _MAX_VISITORS:
            longest_ago = next(iter(self._visitors))
            del self._visitors[longest_ago]
            self._rates.leave(longest_ago)

    def _count(self, *, last: bool = False) -> None:
        if suppressed := self._rates.suppressed(self._stamp(), last=last):
            self._write({**self._when(), "what": SUPPRESSED, "lines": suppressed})

    def _when(self) -> dict[str, object]:
        return {"time": self._wall(), "stamp": self._stamp()}


def _identity_of(access: Access | None) -> dict[str, str]:
    return {} if access is None else {"holder": access.holder, "role": str(access.role)}


def _rounded(values: np.ndarray[Any, Any]) -> list[float]:
    return [round(float(value), _DIGITS) for value in values]


def _numbers(hint: Hint) -> list[float]:
    """Return the numbers by which hints are compared, whatever process holds them."""
    pose = hint.map_from_base
    parts = (pose.position, pose.quaternion_wxyz, hint.covariance)
    return [number for part in parts for number in part.ravel().tolist()]
