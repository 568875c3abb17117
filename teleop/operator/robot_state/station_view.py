"""What the station knows of the robot and of the link, and what it reports to the operator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from localization.types import SECOND
from teleop.operator.robot_state.banner import Banner
from teleop.operator.robot_state.event_list import EventList
from teleop.operator.robot_state.link_words import age_words, plain_reason
from teleop.operator.robot_state.robot_alarms import Notice, RobotAlarms, Severity
from teleop.operator.robot_state.robot_run import RobotRun
from teleop.operator.robot_state.source_ages import STALE, SourceAges

LOST_AFTER: Final = 800_000_000
"""Silence of the robot after which the link is called lost, if a question is not answered either [ns]."""
_ANSWER: Final = 300_000_000
"""Time within which a question is answered, or within twice the last round trip if that is longer [ns]."""
SLOW: Final = 0.5
"""Round trip from which the operator is warned [s]: beyond it people stop driving continuously and begin to move and
wait (Ferrell 1965; Sheridan 1993)."""
_TIME_RUNS: Final = SECOND
"""Silence after which a robot whose server answers is said to stand still in time [ns]."""
_RATES: Final = (("/tf", "pose"), ("/scan", "scan"), ("/local_cloud", "cloud"))
_HEALTH: Final = {
    "tracking": Severity.CALM,
    "lost": Severity.ALARM,
}
"""Severity by health; any other is a warning."""


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


class StationView:
    """Owns what was received, as far as it is reported to an operator; time is an argument."""

    def __init__(self, events: EventList) -> None:
        """Start without a connection; changes become events."""
        self.events = events
        self.ages = SourceAges()
        self.alarms = RobotAlarms()
        self.run = RobotRun()
        self.health, self.reasons = "", ""
        self.placed = False
        """Whether the robot has a pose."""
        self.control, self.controller, self.control_reason = "", "", ""
        self._old_commands = ""
        self.map = ""
        """What is known of the robot's map, in words."""
        self.speed: float | None = None
        """Forward speed as the robot reports it [m/s]."""
        self._connected, self._why, self._since = False, "not connected yet", 0
        self._round_trip: int | None = None
        self._asked: int | None = None
        self._said: dict[str, str] = {}

    def received(self, topic: str, message: Mapping[str, Any], now: int) -> bool:
        """Take a message that arrived at a time [ns]; return whether it is the first of another run."""
        self.run, anew = self.run.after(topic, message)
        if anew:
            self.events.add("the robot began anew: everything before is another recording")
            self.ages.forget()
            self.alarms, self.placed, self.health, self.speed = RobotAlarms(), False, "", None
            self._said.clear()
        self.ages.received(topic, now)
        self._noticed(topic, message, now)
        match topic:
            case "/localization/status":
                self.health = str(message["health"])
                self.reasons = "; ".join(str(reason) for reason in message["reasons"])
                why = f" ({self.reasons})" if self.reasons else ""
                self._changed("health", self.health, f"health: {self.health}{why}")
            case "/tf":
                children = {str(link["child_frame_id"]) for link in message["transforms"]}
                if "base_link" in children:
                    self.placed = "odom" in children
            case "/odom":
                self.speed = float(message["twist"]["twist"]["linear"]["x"])
            case "/teleop/state":
                self.control, self.controller = str(message["state"]), str(message["controller"])
                self.control_reason = str(message["reason"])
                self._old_commands = _old_commands(message)
                if self.controller:
                    self._changed("driver", self.controller, f"{self.controller} drives")
        return anew

    def connection(self, connected: bool, reason: str, now: int) -> None:
        """Note that the connection was made or lost at a time [ns]."""
        self._connected, self._why, self._since = connected, plain_reason(reason), now
        self._asked = None
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

    def link(self, now: int) -> Notice:
        """Return the state of the link at a time [ns]."""
        silence = self.ages.silence(now)
        if not self._connected:
            quiet = now - self._since if silence is None else silence
            return Notice(Severity.ALARM, f"LINK LOST for {age_words(quiet)}: {self._why}")
        if silence is None:
            return Notice(Severity.STALE, "CONNECTED, nothing received yet")
        overdue = self.unanswered(now) > max(_ANSWER, 2 * (self._round_trip or 0))
        if silence > LOST_AFTER and overdue:
            words = f"LINK LOST for {age_words(silence)}: the robot does not answer"
            return Notice(Severity.ALARM, words)
        if silence > _TIME_RUNS:
            words = f"NOTHING PUBLISHED for {age_words(silence)}, though the robot's server answers"
            return Notice(Severity.WARNING, words)
        if silence > STALE:
            return Notice(Severity.STALE, f"NOTHING RECEIVED for {age_words(silence)}")
        if (trip := self.round_trip(now)) is not None and trip > SLOW:
            return Notice(Severity.WARNING, f"SLOW LINK: round trip {trip:.1f} s")
        return Notice(Severity.CALM, "LINK OK")

    def notices(self, now: int) -> tuple[Notice, ...]:
        """Return what to report of the robot at a time [ns], the worst first."""
        found = list(self.alarms.notices(now))
        if self._old_commands and not self.ages.stale("/teleop/state", now):
            found.append(Notice(Severity.WARNING, self._old_commands))
        if self.ages.stale("/localization/status", now) or not self.health:
            age = self.ages.age("/localization/status", now)
            old = f"{age_words(age)} ago: {self.health}" if age is not None else "never received"
            found.append(Notice(Severity.STALE, f"POSE {old}"))
        elif not self.placed:
            found.append(Notice(Severity.WARNING, f"NO POSE, {self.health}: give a hint (h, n)"))
        else:
            severity = _HEALTH.get(self.health, Severity.WARNING)
            why = f": {self.reasons}" if severity is not Severity.CALM and self.reasons else ""
            found.append(Notice(severity, f"{self.health.upper()}{why}"))
        return tuple(sorted(found, key=lambda notice: -notice.severity))

    def figures(self, now: int) -> tuple[str, ...]:
        """Return round trip, rates, speed and tilt at a time [ns], in short lines."""
        trip = self.round_trip(now)
        first = "round trip " + ("unknown" if trip is None else f"{1e3 * trip:.0f} ms")
        rates = [
            f"{name} {self.ages.rate(topic, now):.0f}"
            for topic, name in _RATES
            if self.ages.age(topic, now) is not None
        ]
        fresh = not self.ages.stale("/odom", now)
        speed = "speed ?" if self.speed is None or not fresh else f"{self.speed:+.2f} m/s"
        tilt = self.alarms.tilt
        known = tilt is not None and not self.ages.stale("/imu/data", now)
        angle = f"tilt {math.degrees(tilt):.0f} deg" if known and tilt is not None else "tilt ?"
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
        return Pulse(silence or 0, stale, state, banner)

    def _noticed(self, topic: str, message: Mapping[str, Any], now: int) -> None:
        """Take an alarm, and report a new one."""
        before = {notice.text for notice in self.alarms.notices(now)}
        self.alarms = self.alarms.after(topic, message, now)
        for notice in self.alarms.notices(now):
            # A tilt changes by the degree; it is on the banner.
            if notice.text not in before and not notice.text.startswith("TILTED"):
                self.events.add(notice.text)
        released = topic == "/teleop/state" and not message["estop"]
        if released and any(text.startswith("E-STOP") for text in before):
            self.events.add(f"e-stop released: {message['reason']}")

    def _changed(self, what: str, state: str, text: str) -> None:
        if self._said.get(what) != state:
            self._said[what] = state
            self.events.add(text)


def _old_commands(state: Mapping[str, Any]) -> str:
    """Return in words what the robot does since the driver's commands reach it late; empty if they do not."""
    age = float(state.get("link_age", 0.0))
    slow, refuse = float(state.get("slow_above", 0.0)), float(state.get("refuse_above", 0.0))
    if not str(state["controller"]):
        return ""
    if 0.0 < refuse < age:
        return f"COMMANDS ARRIVE {age:.1f} s OLD: refused"
    if 0.0 < slow < age:
        return f"COMMANDS ARRIVE {age:.1f} s OLD: the robot drives slower"
    return ""
