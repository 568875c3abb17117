"""What the station knows of the robot and of the link, and what it reports to the operator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from localization.types import SECOND
from teleop.operator.operating_data import operating_data
from teleop.operator.robot_state.alarm_rules import Alarm, Notice, Severity, alarms_of
from teleop.operator.robot_state.banner import Banner
from teleop.operator.robot_state.event_list import EventList
from teleop.operator.robot_state.link_words import plain_reason
from teleop.operator.robot_state.reported_facts import ReportedFacts
from teleop.operator.robot_state.robot_run import RobotRun
from teleop.operator.robot_state.source_ages import STALE, SourceAges
from teleop.operator.words import Facts, age_words

_ANSWER: Final = 300_000_000
"""Time within which a question is answered, or within twice the last round trip if that is longer [ns]."""
_RATES: Final = (("/tf", "pose"), ("/scan", "scan"), ("/local_cloud", "cloud"))
_COLOURS: Final = {
    "unknown": Severity.STALE,
    "green": Severity.CALM,
    "amber": Severity.WARNING,
    "red": Severity.ALARM,
}
_TOLD_OTHERWISE: Final = ("link", "place")
"""Groups of alarms whose begin is an event of its own."""


@dataclass(frozen=True, slots=True)
class Pulse:
    """What the display gets ten times a second, whether or not the robot publishes anything; times in ns."""

    silence: int
    """Time since the robot's last message; 0 before the first."""
    stale: frozenset[str]
    """Topics whose last message is old."""
    link: str
    """State of the link: connected, silent or lost."""
    banner: Banner
    """What an operator must see at once."""
    round_trip: float = 0.0
    """Of the link [s]; 0 while it is unknown."""


class StationView:
    """Owns what was received, as far as it is reported to an operator; time is an argument."""

    def __init__(self, events: EventList) -> None:
        """Start without a connection; changes become events."""
        self.events = events
        self.ages = SourceAges()
        self.reported = ReportedFacts()
        self.run = RobotRun()
        self.health, self.reasons = "", ""
        self.control, self.controller, self.control_reason = "", "", ""
        self._commands: Facts = {}
        self._guard: Notice | None = None
        self._active: frozenset[str] = frozenset()
        self.map = ""
        """What is known of the robot's map, in words."""
        self.speed: float | None = None
        """Forward speed as the robot reports it [m/s]."""
        self._connected, self._was_connected, self._why, self._since = False, False, "", 0
        self._round_trip: int | None = None
        self._asked: int | None = None
        self._said: dict[str, str] = {}

    def received(self, topic: str, message: Mapping[str, Any], now: int) -> bool:
        """Take a message that arrived at a time [ns]; return whether it is the first of another run."""
        self.run, anew = self.run.after(topic, message)
        if anew:
            self.events.add("the robot began anew: everything before is another recording")
            self.ages.forget()
            self.reported, self.health, self.speed = ReportedFacts(), "", None
            self._said.clear()
        self.ages.received(topic, now)
        self._noticed(topic, message, now)
        match topic:
            case "/localization/status":
                self.health = str(message["health"])
                self.reasons = "; ".join(str(reason) for reason in message["reasons"])
                why = f" ({self.reasons})" if self.reasons else ""
                self._changed("health", self.health, f"health: {self.health}{why}")
            case "/odom":
                self.speed = float(message["twist"]["twist"]["linear"]["x"])
            case "/teleop/state":
                self.control, self.controller = str(message["state"]), str(message["controller"])
                self.control_reason = str(message["reason"])
                self._commands = _command_facts(message)
                self._guard = _guard_notice(message)
                if self.controller:
                    self._changed("driver", self.controller, f"{self.controller} drives")
        return anew

    def connection(self, connected: bool, reason: str, now: int) -> None:
        """Note that the connection was made or lost at a time [ns]."""
        self._connected, self._why, self._since = connected, plain_reason(reason), now
        self._asked, self._was_connected = None, self._was_connected or connected
        if connected:
            self.events.add(f"connected: {reason}")
        else:
            self._round_trip = None
            self.events.add(f"link lost: {self._why}; the robot brakes by itself")

    def asked(self, now: int) -> None:
        """Note that the server was asked at a time [ns], to measure the round trip."""
        self._asked = now

    def answered(self, now: int) -> None:
        """Note that it answered."""
        if self._asked is not None:
            self._round_trip, self._asked = now - self._asked, None

    def unanswered(self, now: int) -> int:
        """Return for how long the server has owed an answer [ns]."""
        return 0 if self._asked is None else now - self._asked

    def round_trip(self, now: int) -> float | None:
        """Return the round trip [s], at least the time that the present question has waited; None if unknown."""
        if self._round_trip is None and self._asked is None:
            return None
        waiting = self.unanswered(now)
        return max(self._round_trip or 0, waiting) / SECOND

    def facts(self, now: int) -> Facts:
        """Return what is known at a time [ns], by the names that the rules of the alarms use."""
        newest, trip = self.ages.newest, self.round_trip(now)
        # What came over the last connection says nothing of this one.
        silence = None if newest is None else (now - max(newest, self._since)) / SECOND
        fresh = not self.ages.stale("/localization/status", now)
        return {
            **self.reported.facts(now),
            **({} if self.ages.stale("/teleop/state", now) else self._commands),
            "connected": self._connected,
            "was_connected": self._was_connected,
            "offline": (now - self._since) / SECOND,
            "why": self._why,
            "silence": silence,
            "answering": self._round_trip is not None
            and self.unanswered(now) <= max(_ANSWER, 2 * self._round_trip),
            "link": self._grade(trip),
            "link_figures": _trip_words(trip),
            "health": self.health if fresh else None,
            "reason": self.reasons,
        }

    def alarms(self, now: int) -> tuple[Alarm, ...]:
        """Return the alarms at a time [ns], the worst first."""
        return alarms_of(self.facts(now), self._active)

    def link(self, now: int) -> Notice:
        """Return the state of the link at a time [ns]."""
        if found := [alarm for alarm in self.alarms(now) if alarm.group == "link"]:
            return found[0]
        silence = self.ages.silence(now)
        if silence is None:
            text = "Connected, nothing received yet" if self._connected else "Not connected yet"
            return Notice(Severity.STALE, text)
        if silence > STALE:
            return Notice(Severity.STALE, f"Nothing received for {age_words(silence / SECOND)}")
        grade = operating_data("words")["link"]["words"][self._grade(self.round_trip(now))]
        severity = _COLOURS["green" if grade["colour"] == "unknown" else grade["colour"]]
        return Notice(severity, f"Link: {grade['words']}")

    def notices(self, now: int) -> tuple[Notice, ...]:
        """Return what to report of the robot at a time [ns], the worst first."""
        alarms = self.alarms(now)
        found: list[Notice] = [alarm for alarm in alarms if alarm.group != "link"]
        if not any(alarm.group == "place" for alarm in alarms):
            found.append(self._place(now))
        if self._guard is not None and not self.ages.stale("/teleop/state", now):
            found.append(self._guard)
        return tuple(sorted(found, key=lambda notice: -notice.severity))

    def _place(self, now: int) -> Notice:
        """Return what is known of the robot's place."""
        age = self.ages.age("/localization/status", now)
        if age is None:
            return Notice(Severity.STALE, "Nothing is known of its place")
        unknown = {"words": self.health, "colour": "amber"}
        state = operating_data("words")["health"].get(self.health, unknown)
        if age > STALE:
            return Notice(Severity.STALE, f"{age_words(age / SECOND)} ago: {state['words']}")
        severity = _COLOURS[state["colour"]]
        why = f" ({self.reasons})" if severity is not Severity.CALM and self.reasons else ""
        return Notice(severity, f"{state['words']}{why}")

    def _grade(self, trip: float | None) -> str:
        """Return how good the link is by a round trip [s]."""
        limits = operating_data("words")["link"]["limits"]["round_trip"]
        if not self._connected:
            return "lost"
        if trip is None:
            return "unknown"
        if trip <= limits["green"]:
            return "good"
        return "slow" if trip <= limits["amber"] else "bad"

    def figures(self, now: int) -> tuple[str, ...]:
        """Return round trip, rates, speed and tilt at a time [ns], in short lines."""
        rates = [
            f"{name} {self.ages.rate(topic, now):.0f}"
            for topic, name in _RATES
            if self.ages.age(topic, now) is not None
        ]
        fresh = not self.ages.stale("/odom", now)
        speed = "speed ?" if self.speed is None or not fresh else f"{self.speed:+.2f} m/s"
        tilt = self.reported.tilt
        known = tilt is not None and not self.ages.stale("/imu/data", now)
        angle = f"tilt {math.degrees(tilt):.0f} deg" if known and tilt is not None else "tilt ?"
        first = _trip_words(self.round_trip(now))
        return (first, "  ".join(rates) + (" Hz" if rates else "no data"), f"{speed}   {angle}")

    def pulse(self, now: int) -> Pulse:
        """Return what the display gets at a time [ns]."""
        topics = ("/tf", "/local_cloud", "/scan", "/localization/status", "/teleop/state", "/odom")
        stale = frozenset(topic for topic in topics if self.ages.stale(topic, now))
        link, silence = self.link(now), self.ages.silence(now)
        banner = Banner(link, self.notices(now), self.figures(now))
        fresh = silence is not None and silence <= STALE
        state = "connected" if fresh else "silent"
        if link.severity is Severity.ALARM:
            state = "lost"
        return Pulse(silence or 0, stale, state, banner, self.round_trip(now) or 0.0)

    def _noticed(self, topic: str, message: Mapping[str, Any], now: int) -> None:
        """Take what the robot reports, and report a new alarm."""
        before = self.reported
        self.reported = before.after(topic, message, now)
        if self.reported is before:
            return
        alarms = self.alarms(now)
        for alarm in alarms:
            if alarm.kind not in self._active and alarm.group not in _TOLD_OTHERWISE:
                self.events.add(alarm.text)
        self._active = frozenset(alarm.kind for alarm in alarms)
        if before.estop is not None and self.reported.estop is None:
            self.events.add(f"e-stop released: {message['reason']}")

    def _changed(self, what: str, state: str, text: str) -> None:
        if self._said.get(what) != state:
            self._said[what] = state
            self.events.add(text)


def _trip_words(trip: float | None) -> str:
    """Return a round trip [s] in words."""
    return "round trip " + ("unknown" if trip is None else f"{1e3 * trip:.0f} ms")


def _guard_notice(state: Mapping[str, Any]) -> Notice | None:
    """Return what the robot's guard does, and why; None if it does nothing."""
    what, why = str(state.get("guard", "")), str(state.get("guard_reason", ""))
    severity = {"slowed": Severity.INFO, "stopped": Severity.WARNING}.get(what)
    return None if severity is None else Notice(severity, f"Guard: {why}")


def _command_facts(state: Mapping[str, Any]) -> Facts:
    """Return how late the driver's commands reach the robot, what it does about it, and who has switched its guard off."""
    age = float(state.get("link_age", 0.0))
    slow, refuse = float(state.get("slow_above", 0.0)), float(state.get("refuse_above", 0.0))
    if not str(state["controller"]):
        return {}
    by = str(state.get("guard_overridden_by", ""))
    late = "refused" if 0.0 < refuse < age else "slowed" if 0.0 < slow < age else ""
    return {"commands": late, "command_age": age, "guard_off_by": by}
