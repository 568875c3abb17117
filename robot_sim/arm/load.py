"""How much an arm's servos bear, and for how long: words before one burns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from robot_sim.arm.arm_table import JOINTS, ArmTable

STALLED: Final = 0.9
"""Share of the stall torque from which a servo that does not turn counts as stalled."""
STILL: Final = 0.05
"""Speed below which it does not turn [rad/s]: a hundredth of what it could."""
STALL_TIME: Final = 0.4
"""Time after which it is stalled [s]: within half a second, and longer than any start or stop of a motion takes."""

LoadState = Literal["fine", "warm", "overloaded", "stalled"]
"""Of the joint that bears most: warm counts down, the last two have to give way."""


@dataclass(frozen=True, slots=True)
class Load:
    """What the servos bear."""

    shares: tuple[float, ...]
    """Torque of each joint's servo over its stall torque."""
    spent: tuple[float, ...]
    """How much of what its servo stands beyond the long share each joint has used up; 1: all of it."""
    giving_way: tuple[bool, ...]
    """Joints that have to be commanded to where they are, until they bear less than the long share."""
    state: LoadState
    """Of the worst joint."""
    words: str
    """The same for people, with the joint; empty if all is fine."""


class LoadWatch:
    """Watches the torques of an arm's servos. Owns how warm they are, and which of them have to give way.

    A winding's heat goes with the square of its current, and so of its torque. So what counts is the square of the
    share of the stall torque, less that of the share which a servo stands for long, summed over time: the rule that
    motor drives call I2t. It is scaled so that the short share lasts for the short time of the table; a servo that
    bears less than the long share recovers by the same rule.
    """

    def __init__(self, table: ArmTable) -> None:
        """Begin with cold servos."""
        self._joints = [f"{joint.turns} ({joint.name})" for joint in table.joints]
        self._stall = [joint.servo.torque(table.supply) for joint in table.joints]
        self._long = table.holding.long
        self._budget = (table.holding.short**2 - self._long**2) * table.holding.short_time
        self._spent = [0.0] * JOINTS
        self._still = [0.0] * JOINTS
        self._state: list[LoadState] = ["fine"] * JOINTS

    def take(self, elapsed: float, torques: Sequence[float], rates: Sequence[float]) -> Load:
        """Take what was measured, and return what the servos bear.

        Args:
            elapsed: Time since the last call [s].
            torques: Of each joint's servo [N m].
            rates: Speed of each joint [rad/s].
        """
        shares = tuple(
            abs(float(torque)) / stall for torque, stall in zip(torques, self._stall, strict=True)
        )
        for n, (share, rate) in enumerate(zip(shares, rates, strict=True)):
            used = self._spent[n] + (share**2 - self._long**2) * elapsed / self._budget
            self._spent[n] = min(max(used, 0.0), 1.0)
            still = share >= STALLED and abs(rate) < STILL
            self._still[n] = self._still[n] + elapsed if still else 0.0
            self._state[n] = self._judge(n, share)
        worst = max(range(JOINTS), key=lambda n: (_ORDER.index(self._state[n]), shares[n]))
        return Load(
            shares,
            tuple(self._spent),
            tuple(state in _GIVING_WAY for state in self._state),
            self._state[worst],
            self._words(worst, shares[worst]),
        )

    def _judge(self, n: int, share: float) -> LoadState:
        if self._state[n] in _GIVING_WAY and share > self._long:
            return self._state[n]
        if self._still[n] >= STALL_TIME - _ROUNDING:
            return "stalled"
        if self._spent[n] >= 1.0 - _ROUNDING:
            return "overloaded"
        return "warm" if share > self._long else "fine"

    def _words(self, n: int, share: float) -> str:
        bears = f"{self._joints[n]} bears {share:.0%} of its servo's stall torque"
        match self._state[n]:
            case "fine":
                return ""
            case "warm":
                left = (1.0 - self._spent[n]) * self._budget / (share**2 - self._long**2)
                return f"{bears}: it stands {self._long:.0%} for long, this for {left:.1f} s"
            case "overloaded":
                return f"{bears}, longer than it stands: it gives way"
            case "stalled":
                return f"{bears} and does not turn: it backs off to where it touched"


_ORDER: Final[tuple[LoadState, ...]] = ("fine", "warm", "overloaded", "stalled")
_GIVING_WAY: Final[tuple[LoadState, ...]] = ("overloaded", "stalled")
_ROUNDING: Final = 1e-9
"""Of a sum of ticks."""
