"""Hints of one station: sent, remembered, and the verdicts on them reported."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from localization.types import Pose
from teleop.operator.message_decoding import stamp_of
from teleop.operator.operating_data import operating_data
from teleop.operator.operator_client import OperatorClient
from teleop.operator.robot_state.event_list import EventList
from teleop.operator.robot_state.hint_verdicts import TAKEN, SentHint
from teleop.operator.words import sentence


class HintDesk:
    """Owns the hints that wait for a verdict."""

    def __init__(
        self, operator: OperatorClient, events: EventList, places: Mapping[str, Pose] | None
    ) -> None:
        """Start without hints.

        Args:
            operator: The operator's client.
            events: Events for the user.
            places: Named places; those that the robot names by default.
        """
        self._operator, self._events, self._places = operator, events, places
        self.verdict: str | None = None
        """Verdict on the hint of the command line; None before it is answered."""
        self._sent: list[SentHint] = []
        self._asked: SentHint | None = None
        self._judged = -1
        self._begun: int | None = None

    @property
    def taken(self) -> bool:
        """Whether the hint of the command line was taken."""
        return self.verdict in TAKEN

    def restart(self) -> None:
        """Forget the hints of a run of the robot that is over."""
        self._sent.clear()
        self._judged, self._begun = -1, None

    def clock_received(self) -> None:
        """Note that the robot's time is known: verdicts of before are old ones."""
        self._begun = self._operator.now if self._begun is None else self._begun

    def menu(self) -> Mapping[str, Pose]:
        """Return the places for hints."""
        places = self._operator.places if self._places is None else self._places
        if not places:
            self._events.add("no places are known: start with --places FILE, or type the numbers")
        return places

    async def send(self, pose: Pose, *, asked: bool = False) -> None:
        """Send a hint, and remember it for its verdict."""
        sent = SentHint(pose, self._operator.now)
        self._sent.append(sent)
        if asked:
            self._asked = sent
        x, y, _ = pose.position
        heading = np.rad2deg(pose.yaw)
        self._events.add(f"hint sent: x {x:.2f} m, y {y:.2f} m, heading {heading:.0f} deg")
        await self._operator.hint(pose, np.zeros((6, 6)))

    def judge(self, message: Mapping[str, Any]) -> None:
        """Report a verdict, unless it was reported before or given before this station came."""
        stamp = stamp_of(message) or 0
        verdict, reason = str(message["verdict"]), sentence(str(message["reason"]))
        words = operating_data("words")["verdicts"].get(verdict, verdict)
        mine = next((sent for sent in self._sent if sent.answered_by(message)), None)
        if mine is not None:
            self._sent.remove(mine)
            self._judged = stamp
            if mine is self._asked:
                self.verdict = verdict
            self._events.add(f"{sentence(f'hint {words}')} {reason}".strip())
        elif self._begun is not None and stamp > max(self._judged, self._begun):
            self._judged = stamp
            self._events.add(f"{sentence(f'hint of another client {words}')} {reason}".strip())
