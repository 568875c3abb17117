"""How a robot stopped, by the wheels' own rates in its log, whatever becomes of its server."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.logs.open_log import open_log
from localization.types import SECOND, WheelSpeeds
from robot_sim import TICK_NS

REQUEST: Final = 0.5 + TICK_NS / SECOND
"""A command may hold so long after the last one arrived, and a tick [s] (docs/teleoperation.md, watchdog)."""
LAG: Final = 0.05
"""Of the servos, and a tick [s] (docs/safety.md, t_R)."""
BRAKING: Final = 1.0
"""[m/s^2] (docs/robot.md)."""
MOVING: Final = 0.1
"""Speed below which a failure happened to a robot that hardly moved [m/s]; no trial then."""
REST: Final = 0.03
"""Greatest speed of a robot at rest [m/s]: noise of its encoders, 0.1 rad/s on wheels of 0.11 m, three times."""


@dataclass(frozen=True, slots=True)
class Stop:
    """What the wheels did after a failure."""

    speed: float
    """Greatest after the failure [m/s]."""
    braked_after: float
    """Until the wheels began to brake, by half the speed and the known braking [s]."""
    way: float
    """From the failure to rest [m]."""
    bound: float
    """Longest way that the documents allow [m]."""
    drove_on: float
    """Greatest speed once it should have been at rest [m/s]."""

    @property
    def failed(self) -> str:
        """What is wrong with it; empty if nothing."""
        if self.braked_after > REQUEST + LAG:
            return f"braked after {self.braked_after:.3f} s"
        if self.way > self.bound:
            return f"came {self.way:.3f} m, more than {self.bound:.3f}"
        if self.drove_on > REST:
            return f"drove on at {self.drove_on:.2f} m/s"
        return ""


class Wheels:
    """The robot's speed over time, by its wheels."""

    def __init__(self, logs: Iterable[Path]) -> None:
        """Read a robot's logs; each ends with its estimator."""
        found = [r for log in logs for r in open_log(log) if isinstance(r, WheelSpeeds)]
        found.sort(key=lambda r: r.stamp)
        self._times: FloatArray = np.array([r.stamp for r in found]) / SECOND
        # Forward speed and turn are braked each by its own ramp; the sides' mean is the forward speed.
        self._forward: FloatArray = np.abs([0.5 * (r.left + r.right) for r in found])

    def stop(self, failed: float, until: float) -> Stop | None:
        """Judge the time from a failure [s] to the end of what was watched [s]; None if the robot hardly moved, or the log
        ends within it."""
        inside = (self._times >= failed) & (self._times <= until)
        times, speeds = self._times[inside] - failed, self._forward[inside]
        if len(times) < 10 or speeds[:3].max() < MOVING:
            return None
        speed = float(max(speeds[times <= REQUEST + LAG]))
        slow = (speeds <= 0.5 * speed) & (times > times[speeds.argmax()])
        # Between two readings, which are a tick apart, the speed falls evenly.
        i = max(1, int(slow.argmax()))
        halved = float(np.interp(-0.5 * speed, -speeds[i - 1 : i + 1], times[i - 1 : i + 1]))
        braked = (halved if slow.any() else np.inf) - 0.5 * speed / BRAKING
        allowed = REQUEST + LAG + speed / BRAKING
        late = speeds[times > allowed + LAG]
        if not len(
            late
        ):  # the log ends before: the estimator that writes it was killed in the next trial
            return None
        return Stop(
            speed=speed,
            braked_after=braked,
            way=float((speeds[1:] * np.diff(times)).sum()),
            bound=speed * (REQUEST + LAG) + speed**2 / (2.0 * BRAKING),
            drove_on=float(late.max()),
        )
