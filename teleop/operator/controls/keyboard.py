"""Keyboard driving: the keys that are held, with or without reports of their releases, as a twist."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from localization.types import Twist
from teleop.operator.controls.key_events import Key, KeyEvent
from teleop.operator.controls.repeat_timing import RepeatTiming
from teleop.operator.operating_data import gears, key_actions

CAREFUL: Final = 0
"""Index of the gear at the start where releases are not reported: a tap drives on for a while there."""
NORMAL: Final = 1
"""Index of the gear at the start elsewhere."""
TERMINAL_SILENCE: Final = 600_000_000
"""With reports of releases: all keys count as released if the terminal has not answered for this long [ns]. A
terminal whose connection hangs would never report the release."""

FORWARD: Final = {
    key: 1 if action == "forward" else -1
    for key, action in key_actions().items()
    if action in ("forward", "backward")
}
"""Keys that drive, by the sign of the speed."""
TURN: Final = {
    key: 1 if action == "left" else -1
    for key, action in key_actions().items()
    if action in ("left", "right")
}
"""Keys that turn, by the sign of the turn rate."""


@dataclass(slots=True)
class Keyboard:
    """Remembers which drive keys are held; time is an argument.

    Of two keys for one axis the last counts. Without reports of releases the terminal repeats only the key that
    was pressed last: an earlier one that was alive then counts as held until the last one ends, since its
    release is not reported.
    """

    reports_releases: bool = False
    """Whether the terminal reports releases."""
    gear: int = NORMAL
    """Index of the gear."""
    timing: RepeatTiming = field(default_factory=RepeatTiming)
    """Measured repeats, for terminals that report no releases."""
    _held: dict[str, int] = field(default_factory=dict)
    _last: str | None = None
    _pressed: int = 0
    _newest: int = 0
    _repeating: bool = False
    _answered: int = 0
    _blocked_until: int = 0

    def take(self, key: Key, now: int) -> bool:
        """Take an event of a key at a time [ns]; return whether it is a key that drives."""
        if key.name not in FORWARD and key.name not in TURN:
            return False
        if self.reports_releases:
            self._answered = now
            if key.event is KeyEvent.RELEASE:
                self._held.pop(key.name, None)
            elif key.event is KeyEvent.PRESS:
                self._begin(key.name, now)
        elif key.event is not KeyEvent.RELEASE:
            self._strike(key.name, now)
        return True

    def answered(self, now: int) -> None:
        """Note that the terminal answered at a time [ns]."""
        self._answered = now

    def release_all(self) -> None:
        """Let all keys go."""
        self._held.clear()
        self._last = None

    def block(self, now: int) -> None:
        """Let all keys go, and take none before it was released and is pressed anew; at a time [ns]."""
        self.release_all()
        self._blocked_until = 0 if self.reports_releases else now + self.timing.first_hold

    def shift(self, gear: int) -> None:
        """Engage a gear by its index, or the one that is nearest to it."""
        self.gear = min(max(gear, 0), len(gears()) - 1)

    def twist(self, now: int) -> tuple[Twist, bool]:
        """Return the twist that the held keys request at a time [ns], and whether any is held (the deadman)."""
        self._expire(now)
        gear = gears()[self.gear]
        forward = sum(FORWARD.get(key, 0) for key in self._held)
        turn = sum(TURN.get(key, 0) for key in self._held)
        return Twist.planar(gear.speed * forward, gear.turn * turn), bool(self._held)

    @property
    def unknown(self) -> str:
        """What this terminal does not report, for the operator; empty if it reports releases."""
        if self.reports_releases:
            return ""
        t = self.timing
        how = "measured" if t.measured else "assumed"
        return (
            f"releases are not reported here: a key counts as held {t.first_hold / 1e9:.2f} s after its press "
            f"({how}), {t.repeat_hold / 1e9:.2f} s after a repeat; of two keys, release both"
        )

    def _begin(self, name: str, now: int) -> None:
        """Hold a key; one for the same axis that was held is dropped."""
        axis = FORWARD if name in FORWARD else TURN
        for other in [key for key in self._held if key in axis]:
            del self._held[other]
        self._held[name] = now

    def _strike(self, name: str, now: int) -> None:
        """Take a character: a press or a repeat, which differ by their times only."""
        self._expire(now)
        if now < self._blocked_until:  # a repeat, or a press that looks like one
            self._blocked_until = now + self.timing.first_hold
            return
        if name != self._last or name not in self._held:
            if (
                name in self._held
            ):  # it was let go and is pressed anew: of the other one nothing is known
                self._held.clear()
            self._begin(name, now)
            self._last, self._pressed, self._newest, self._repeating = name, now, now, False
            return
        interval = now - self._newest
        if self._repeating or self.timing.is_repeat(interval):
            if self._newest > self._pressed:
                if not self._repeating:
                    self.timing = self.timing.with_delay(self._newest - self._pressed)
                self.timing = self.timing.with_interval(interval)
            self._repeating = True
        elif self._newest > self._pressed:
            self._pressed = self._newest  # the stroke before was a tap of its own
        self._newest = now

    def _expire(self, now: int) -> None:
        """Let go what is held no longer."""
        if self.reports_releases:
            if now - self._answered > TERMINAL_SILENCE:
                self.release_all()
        elif self._last is not None:
            hold = self.timing.repeat_hold if self._repeating else self.timing.first_hold
            if now - self._newest > hold:
                self.release_all()
