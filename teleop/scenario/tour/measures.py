"""What is measured while a tour is driven: computing times, traffic, and the time from a command to the motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from localization.types import SECOND, HintVerdict
from robot_sim import TICK_NS
from teleop.robot.inbox import DriveCommand
from teleop.robot.tick_record import TickRecord
from teleop.rosbridge.framing.outgoing_frames import OutgoingFrame, Output
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer

_MOVING: Final = 0.01
"""Speed above which the robot counts as moving [m/s] or [rad/s]."""


@dataclass(frozen=True, slots=True)
class StageTime:
    """Wall time of one stage of the computation."""

    name: str
    """Name of the stage."""
    count: int
    """Number of times it ran."""
    mean: float
    """Mean duration [ms]."""
    p50: float
    """Median duration [ms]."""
    p99: float
    """99th percentile of the duration [ms]."""
    total: float
    """Sum of all durations [s]."""

    @classmethod
    def of(cls, name: str, laps: Sequence[float]) -> Self:
        """Summarise the durations [s] of a stage."""
        ms = np.array(laps) * 1e3
        p50, p99 = np.percentile(ms, [50, 99])
        return cls(name, len(ms), float(ms.mean()), float(p50), float(p99), float(ms.sum() / 1e3))


@dataclass(frozen=True, slots=True)
class TopicTraffic:
    """Messages sent over the socket on one topic."""

    topic: str
    """Name of the topic, or a group of other operations in parentheses."""
    messages: int
    """Number of frames."""
    bytes: int
    """Total size of the frames [bytes]."""


class Meter(Observer):
    """Counts the frames and bytes of each topic that are sent and received."""

    def __init__(self) -> None:
        self._counts: dict[str, list[int]] = {}

    def received(self, connection: Connection, frame: str | bytes) -> None:
        """Count a received frame."""
        self._add("(to the robot)", len(frame))

    def sent(self, connection: Connection, output: Output) -> None:
        """Count a sent frame."""
        if isinstance(output, OutgoingFrame):
            self._add(output.topic or "(answers)", len(output.payload))

    def _add(self, topic: str, size: int) -> None:
        count = self._counts.setdefault(topic, [0, 0])
        count[0] += 1
        count[1] += size

    def traffic(self) -> tuple[TopicTraffic, ...]:
        """Return the counts by topic, most bytes first."""
        rows = sorted(self._counts.items(), key=lambda row: (-row[1][1], row[0]))
        return tuple(TopicTraffic(topic, *count) for topic, count in rows)


class TickMeasures:
    """Follows the ticks of a drive."""

    def __init__(self) -> None:
        self.begun = False
        """Whether there was a tick."""

        self.joy_to_motion: list[float] = []
        """Robot time from each request that ended a standstill to the first motion [s]."""

        self.matched: TickRecord | None = None
        """The last tick whose sweep was registered."""

        self.verdicts: list[HintVerdict] = []
        """Verdicts about hints, in order."""

        self._moved = False
        self._requested: int | None = None

    def take(self, tick: TickRecord) -> None:
        """Take one tick."""
        self.begun = True
        estimate = tick.estimate
        if estimate.match is not None and estimate.sweep is not None and estimate.map_from_base:
            self.matched = tick
        self.verdicts += [e.verdict for e in tick.estimates if e.verdict is not None]
        moving, asked = _moves(tick), _asked(tick)
        twist = tick.control.twist
        commanded = bool(twist.linear.any() or twist.angular.any())
        if self._requested is None and not self._moved and asked and commanded:
            self._requested = asked[-1].stamp or tick.stamp - TICK_NS
        if self._requested is not None and moving:
            self.joy_to_motion.append((tick.stamp - self._requested) / SECOND)
            self._requested = None
        elif not commanded:
            self._requested = None
        self._moved = moving


def _asked(tick: TickRecord) -> list[DriveCommand]:
    return [m for m in tick.inbox if isinstance(m, DriveCommand) and not m.request.neutral]


def _moves(tick: TickRecord) -> bool:
    twist = tick.truth.twist
    return bool(np.abs(twist.linear[:2]).max() > _MOVING or abs(twist.angular[2]) > _MOVING)


def verdict_line(verdict: HintVerdict) -> str:
    """Return a line about the verdict of a hint."""
    after = (verdict.stamp - verdict.hint.stamp) / SECOND
    line = f"{verdict.verdict.value} after {after:.2f} s: {verdict.reason}"
    if verdict.candidates:
        moved = verdict.candidates[0].map_from_base.position - verdict.hint.map_from_base.position
        line += f", {float(np.hypot(moved[0], moved[1])):.2f} m from the hint"
    return line


def stage_times(laps: Mapping[str, Sequence[float]]) -> tuple[StageTime, ...]:
    """Return the times of all stages but that of the preparation, which is no part of the drive."""
    return tuple(StageTime.of(name, each) for name, each in laps.items() if name != "set-up")
