"""Validation of readings: what cannot be true is rejected with a sentence, before it reaches the filter."""

from __future__ import annotations

from bisect import bisect_left, insort
from dataclasses import dataclass

import numpy as np

from localization.types import (
    SECOND,
    Hint,
    Inertial,
    Mounts,
    Odometry,
    PointScan,
    Reading,
    Scan,
    WheelSpeeds,
    end_of,
)

_FASTEST_RIM = 20.0
"""Largest rim speed [m/s]; no robot of this class rolls faster."""
_FASTEST_TURN = 50.0
"""Largest angular velocity [rad/s]; beyond any gyro's range."""
_STRONGEST_FORCE = 500.0
"""Largest specific force [m/s^2]; beyond any accelerometer's range."""
_LONGEST_JUMP = 60 * SECOND
"""A clock that jumps ahead by more than this between two readings of a kind was reset [ns]."""

_LONGEST_PAUSE = 10 * SECOND
"""A pause of odometry up to this long is believed at once [ns]: loggers stall for seconds."""
_FARTHEST_DRIVE = 1e6
"""Largest coordinate of odometry [m]; no base drives so far without a reset."""

_PLURAL: dict[type[Reading], str] = {
    Scan: "other scans",
    WheelSpeeds: "wheel speeds",
    Inertial: "inertial readings",
    Odometry: "odometry",
}

_LONGEST_SCAN = 2 * SECOND
"""Longest duration of a scan [ns]."""
_FARTHEST_AHEAD = SECOND
"""A scan may arrive before the inertial readings that cover it, but by no more than this [ns]."""
_CAUGHT_UP = SECOND // 4
"""Odometry that follows a scan of the same clock is stamped at most this much before its end [ns]: the difference
of two sensors' latencies."""


@dataclass(slots=True)
class _Lead:
    """A reading that was stamped far ahead of the readings that advance time."""

    end: int
    """When it is complete [ns]."""
    honest: bool
    """Whether those before it were caught up with."""
    followed: bool | None = None
    """Whether the next reading that advanced time caught up with it; None before that."""


class ReadingValidator:
    """Checks readings one by one; keeps the last stamps of each source."""

    def __init__(
        self,
        mounts: Mounts,
        leader: tuple[type[Reading], ...] = (Inertial,),
        horizon: int = 2 * SECOND,
    ) -> None:
        """Build.

        Args:
            mounts: ``base_from_scanner`` by the scanner's frame.
            leader: the kinds of readings that advance time.
            horizon: largest delay of a reading [ns]; with 0, stamps must increase.
        """
        self._mounts, self._leader, self._horizon = mounts, leader, horizon
        self._received: dict[str, list[int]] = {}
        self._jumped: int | None = None
        self._ahead: dict[str, _Lead | None] = {}
        self.refused = 0
        """Number of readings that were rejected."""

    def repeats(self, reading: Reading) -> bool:
        """Return whether a reading is the odometry of an instant that was accepted already.

        Logs write the pose of an instant with each line that needs it; poses are absolute, so that one of
        them is enough.
        """
        return isinstance(reading, Odometry) and reading.stamp in self._received.get("odometry", ())

    def refusal(self, reading: Reading, now: int = 0) -> str | None:
        """Return why a reading is rejected; None if it is accepted.

        Args:
            reading: the newest one.
            now: stamp of the newest reading that advanced time [ns], which the others must not run far
                ahead of; 0 before the first.
        """
        why = self._order(reading, now) or self._content(reading)
        if why is None:
            self._keep(_source(reading), reading.stamp)
            if isinstance(reading, self._leader):
                self._jumped = None
                if reading.stamp > now:
                    self._follow(reading.stamp)
        else:
            self.refused += 1
        return why

    def _keep(self, source: str, stamp: int) -> None:
        """Keep the stamps of a source within the horizon, in order."""
        stamps = self._received.setdefault(source, [])
        insort(stamps, stamp)
        if len(stamps) > 1 and stamps[0] < stamps[-1] - self._horizon - 2 * SECOND:
            del stamps[: bisect_left(stamps, stamps[-1] - self._horizon - SECOND)]

    def _order(self, reading: Reading, now: int) -> str | None:
        source = _source(reading)
        if isinstance(reading, Hint):
            return None
        leads = isinstance(reading, self._leader)
        ahead = end_of(reading) - now
        if now and not leads and self._runs_ahead(source, end_of(reading), now):
            return (
                f"refused {source} stamped {ahead / SECOND:.1f} s ahead of the {_PLURAL[self._leader[0]]}: "
                "all sensors must share one clock"
            )
        stamps = self._received.get(source)
        last = stamps[-1] if stamps else None
        if last is not None and reading.stamp <= last and not self._horizon:
            return (
                f"refused {source} stamped {reading.stamp / SECOND:.3f} s, not after "
                f"{last / SECOND:.3f} s: stamps must increase"
            )
        if stamps and reading.stamp in stamps:
            return (
                f"refused {source} stamped {reading.stamp / SECOND:.3f} s again: "
                "each must have a stamp of its own"
            )
        late = now - end_of(reading)
        if now and late > self._horizon > 0:
            reset = "; start a new localiser after a reset of the clock"
            return (
                f"refused {source}: {late / SECOND:.1f} s late, with {self._horizon / SECOND:.1f} s to "
                f"come in{reset if late > _LONGEST_JUMP else ''}"
            )
        return self._jump(source, reading, now) if leads and now else None

    def _runs_ahead(self, source: str, end: int, now: int) -> bool:
        """Return whether a source's clock runs ahead of the readings that advance time.

        Inertial readings come so often that a scan cannot be the first. Where odometry is as rare as scans, or
        after a pause of the whole log, a scan is as far ahead as the pause was long, and the odometry that
        follows it catches up; with a clock that runs ahead it does not.

        Args:
            source: of the reading.
            end: when the reading is complete [ns].
            now: stamp of the newest reading that advanced time [ns].
        """
        ahead, before, new = end - now, self._ahead.get(source), source not in self._ahead
        if ahead <= _FARTHEST_AHEAD:
            self._ahead[source] = None
            return False
        if Inertial in self._leader:
            return True
        if before is None or before.followed:
            self._ahead[source] = _Lead(end, honest=before is not None)
            return ahead > (_LONGEST_PAUSE if new else _LONGEST_JUMP)
        self._ahead[source] = _Lead(end, honest=before.honest and before.followed is None)
        believed = before.honest or end - before.end > _FARTHEST_AHEAD
        return before.followed is False or not believed or ahead > _LONGEST_PAUSE

    def _follow(self, stamp: int) -> None:
        """Note which readings that were far ahead the one that advances time to a stamp [ns] catches up with."""
        for lead in self._ahead.values():
            if lead is not None and lead.followed is None:
                lead.followed = stamp >= lead.end - _CAUGHT_UP

    def _jump(self, source: str, reading: Reading, now: int) -> str | None:
        """A jump of time is believed when another source jumped too, or the next reading follows it.

        One reading may have a bad stamp.
        """
        step = reading.stamp - now
        if step <= _FARTHEST_AHEAD:
            return None
        if step > _LONGEST_JUMP:
            return (
                f"refused {source} stamped {step / SECOND:.0f} s after the one "
                "before: start a new localiser after a reset of the clock"
            )
        before, self._jumped = self._jumped, reading.stamp
        if isinstance(reading, Odometry) and step <= _LONGEST_PAUSE:
            # Poses are absolute: their difference is as good after a pause.
            return None
        newest = (stamps[-1] for name, stamps in self._received.items() if name != source)
        confirmed = any(abs(reading.stamp - stamp) <= _FARTHEST_AHEAD for stamp in newest)
        if confirmed or (before is not None and 0 < reading.stamp - before <= _FARTHEST_AHEAD):
            return None
        return (
            f"refused {source} stamped {step / SECOND:.1f} s after the one before: "
            "the next ones are taken if they follow it"
        )

    def _content(self, reading: Reading) -> str | None:
        match reading:
            case Scan():
                if reading.scanner not in self._mounts:
                    return self._unknown(reading.scanner)
                if len(reading.ranges) == 0:
                    return f"refused an empty scan of {reading.scanner}"
                if reading.end_stamp - reading.stamp > _LONGEST_SCAN:
                    return _too_long(reading)
                if not np.isfinite(reading.angles).all():
                    return f"refused a scan of {reading.scanner}: angles must be finite"
            case PointScan():
                if reading.scanner not in self._mounts:
                    return self._unknown(reading.scanner)
                if len(reading.points) == 0:
                    return f"refused an empty scan of {reading.scanner}"
                if reading.end_stamp - reading.stamp > _LONGEST_SCAN:
                    return _too_long(reading)
            case WheelSpeeds():
                fastest = max(abs(reading.left), abs(reading.right))
                if (
                    not fastest <= _FASTEST_RIM
                    or not np.isfinite([reading.left, reading.right]).all()
                ):
                    return (
                        f"refused wheel speeds {reading.left:g}, {reading.right:g} m/s: "
                        f"must be finite and within {_FASTEST_RIM:g} m/s"
                    )
            case Inertial():
                if not np.abs(reading.angular_velocity).max() <= _FASTEST_TURN:
                    return "refused an inertial reading: angular velocity must be finite, in rad/s"
                if not np.abs(reading.specific_force).max() <= _STRONGEST_FORCE:
                    return "refused an inertial reading: specific force must be finite, in m/s^2"
            case Odometry():
                if np.abs(reading.odom_from_base.position).max() > _FARTHEST_DRIVE:
                    return "refused odometry: its position must be in metres"
            case Hint():
                pass
        return None

    def _unknown(self, scanner: str) -> str:
        known = ", ".join(sorted(self._mounts)) or "none"
        return f"refused a scan of unknown scanner {scanner!r}; known: {known}"


def _too_long(scan: Scan | PointScan) -> str:
    took = (scan.end_stamp - scan.stamp) / SECOND
    return (
        f"refused a scan of {scan.scanner} that took {took:.0f} s: offsets must be in nanoseconds"
    )


def _source(reading: Reading) -> str:
    match reading:
        case Scan() | PointScan():
            return f"scan of {reading.scanner}"
        case WheelSpeeds():
            return "wheel speeds"
        case Inertial():
            return "inertial reading"
        case Odometry():
            return "odometry"
        case Hint():
            return "hint"
