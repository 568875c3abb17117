"""The door: readings that cannot be true are refused with a sentence, before they reach the filter."""

from __future__ import annotations

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
)

_FASTEST_RIM = 20.0
"""[m/s]; no robot of this class rolls faster, whatever its encoders say."""
_FASTEST_TURN = 50.0
"""[rad/s]; beyond any gyro's range."""
_STRONGEST_FORCE = 500.0
"""[m/s^2]."""
_LONGEST_JUMP = 60 * SECOND
"""A clock that leaps ahead farther than this between two readings of a kind has been reset."""

_FARTHEST_DRIVE = 1e6
"""No base adds up so much without a rest [m]."""

_PLURAL: dict[type[Reading], str] = {
    Scan: "other scans",
    WheelSpeeds: "wheel speeds",
    Inertial: "inertial readings",
    Odometry: "odometry",
}

_FARTHEST_AHEAD = SECOND
"""A scan may come before the inertial readings that cover it, but not from the future [ns]."""


class Intake:
    """Checks readings one by one; remembers the last stamp of each source."""

    def __init__(self, mounts: Mounts, leader: tuple[type[Reading], ...] = (Inertial,)) -> None:
        """Build for scanners by frame name, and the kind of reading that moves time on."""
        self._mounts = mounts
        self._leader = leader
        self._last: dict[str, int] = {}
        self.refused = 0
        """How many readings were turned away."""

    def refusal(self, reading: Reading, now: int = 0) -> str | None:
        """Return why a reading is refused; None if it is welcome.

        Args:
            reading: what came.
            now: stamp of the newest reading that moved time on [ns], which the others must not run far
                ahead of; 0 if there was none yet.
        """
        why = self._order(reading, now) or self._content(reading)
        if why is None:
            self._last[_source(reading)] = reading.stamp
        else:
            self.refused += 1
        return why

    def _order(self, reading: Reading, now: int) -> str | None:
        source = _source(reading)
        ahead = reading.stamp - now
        if now and ahead > _FARTHEST_AHEAD and not isinstance(reading, (*self._leader, Hint)):
            return (
                f"refused {source} stamped {ahead / SECOND:.1f} s ahead of the {_PLURAL[self._leader[0]]}: "
                "all sensors must share one clock"
            )
        last = self._last.get(source)
        if last is None or isinstance(reading, Hint):
            return None
        if reading.stamp <= last:
            return (
                f"refused {source} stamped {reading.stamp / SECOND:.3f} s, not after "
                f"{last / SECOND:.3f} s: stamps must increase"
            )
        if reading.stamp - last > _LONGEST_JUMP:
            return (
                f"refused {source} stamped {(reading.stamp - last) / SECOND:.0f} s after the one "
                "before: start a new localiser after a reset of the clock"
            )
        return None

    def _content(self, reading: Reading) -> str | None:
        match reading:
            case Scan():
                if reading.scanner not in self._mounts:
                    return self._stranger(reading.scanner)
                if len(reading.ranges) == 0:
                    return f"refused an empty scan of {reading.scanner}"
                if not np.isfinite(reading.angles).all():
                    return f"refused a scan of {reading.scanner}: angles must be finite"
            case PointScan():
                if reading.scanner not in self._mounts:
                    return self._stranger(reading.scanner)
                if len(reading.points) == 0:
                    return f"refused an empty scan of {reading.scanner}"
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

    def _stranger(self, scanner: str) -> str:
        known = ", ".join(sorted(self._mounts)) or "none"
        return f"refused a scan of unknown scanner {scanner!r}; known: {known}"


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
