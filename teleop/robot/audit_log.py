"""Who did what to the robot, or tried to: commands, hints, e-stops, comings and goings, as lines."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from localization.types import Hint, HintVerdict
from teleop.joystick import Wish
from teleop.robot.audit_rate_limit import Rations
from teleop.robot.robot import Drive, Snapshot
from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.refusals import Refusal
from teleop.rosbridge.server.server import Server

_DIGITS: Final = 6
"""Decimals of what is told: micrometres."""

_HARMLESS: Final = ("subscribe", "unsubscribe", "unadvertise", "set_level", "status")
"""Operations that ask for nothing to be done: to be refused one is no event."""

_MOST_ASKED: Final = 64
"""Hints whose senders are remembered until they are answered."""


class Audit(Observer):
    """Turns what happens into lines; owns which wish of each client it has told last."""

    def __init__(
        self,
        write: Callable[[dict[str, Any]], None],
        server: Server,
        *,
        stamp: Callable[[], int],
        wall: Callable[[], str],
    ) -> None:
        """Begin to listen.

        Args:
            write: Takes each line.
            server: Whose clients come and go.
            stamp: Returns the time of the robot's clock [ns].
            wall: Returns date and time, for people.
        """
        self._write = write
        self._stamp, self._wall = stamp, wall
        self._who: dict[str, dict[str, str]] = {}
        self._told: dict[str, tuple[Wish, str]] = {}
        self._asked: deque[tuple[Hint, str]] = deque(maxlen=_MOST_ASKED)
        self._rations = Rations()
        server.protocol.observers.add(self)

    def hint(self, client: str, hint: Hint) -> None:
        """Tell of a hint, with the standard deviations its sender gave."""
        self._asked.append((hint, client))
        pose, sigmas = hint.map_from_base, np.sqrt(np.clip(np.diag(hint.covariance), 0.0, None))
        self._line(
            "hint",
            client,
            position=_rounded(pose.position),
            orientation_wxyz=_rounded(pose.quaternion_wxyz),
            sigmas=_rounded(sigmas),
        )

    def order(self, client: str, what: str, refused: str = "") -> None:
        """Tell of an e-stop, its reset, or a take-over."""
        self._line(what, client, **({"refused": refused} if refused else {}))

    def renewed(self, gone: Sequence[str]) -> None:
        """Tell that the tokens were read again, and who was disconnected for it."""
        self._write({**self._when(), "what": "tokens read again", "disconnected": list(gone)})

    def hear(self, snapshot: Snapshot) -> None:
        """Tell of the commands of a tick: of each client's the newest, if it is not the last again."""
        refusals = dict(snapshot.refusals)
        newest = {m.client: m.wish for m in snapshot.inbox if isinstance(m, Drive)}
        for client, wish in newest.items():
            refused = refusals.get(client, "")
            last = self._told.get(client)
            if last is not None and _same(last[0], wish) and last[1] == refused:
                continue
            if client in self._who:
                self._told[client] = wish, refused
            self._line(
                "drive",
                client,
                forward=round(float(wish.twist.linear[0]), _DIGITS),
                turn=round(float(wish.twist.angular[2]), _DIGITS),
                deadman=wish.enabled,
                kind="drive refused" if refused else "drive",
                **({"refused": refused} if refused else {}),
            )
        for estimate in snapshot.estimates:
            if estimate.verdict is not None:
                self._answered(estimate.verdict)

    def end(self) -> None:
        """Tell how many lines were left out that no line has told of."""
        self._count(last=True)

    def _answered(self, verdict: HintVerdict) -> None:
        for hint, client in self._asked:  # where the robot is put at the start is nobody's hint
            if hint is verdict.hint:
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
        self._note(connection.name, connection.access)
        self._line("connected", connection.name)

    def disconnected(self, connection: Connection, now: int) -> None:
        """Log the end of a connection."""
        name = connection.name
        self._line("disconnected", name)
        self._who.pop(name, None)
        self._told.pop(name, None)
        self._rations.leave(name)

    def authenticated(self, connection: Connection, access: Access | None, now: int) -> None:
        """Log an authentication, or its rejection."""
        name = connection.name
        if access is None:
            self._line("auth refused", name)
        else:
            self._note(name, access)
            self._line("auth", name)

    def _note(self, name: str, access: Access | None) -> None:
        self._who[name] = (
            {} if access is None else {"holder": access.holder, "role": str(access.role)}
        )

    def _line(self, what: str, client: str, *, kind: str = "", **more: object) -> None:
        if not self._rations.take(kind or what, client, self._stamp()):
            return
        self._count()
        whose = {"client": client, **self._who.get(client, {})}
        self._write({**self._when(), "what": what, **whose, **more})

    def _count(self, *, last: bool = False) -> None:
        if untold := self._rations.untold(self._stamp(), last=last):
            self._write({**self._when(), "what": "not told", "lines": untold})

    def _when(self) -> dict[str, object]:
        return {"time": self._wall(), "stamp": self._stamp()}


def _rounded(values: np.ndarray[Any, Any]) -> list[float]:
    return [round(float(value), _DIGITS) for value in values]


def _same(one: Wish, other: Wish) -> bool:
    return (
        one.enabled == other.enabled
        and bool(np.array_equal(one.twist.linear, other.twist.linear))
        and bool(np.array_equal(one.twist.angular, other.twist.angular))
    )
