"""Display on a thread of its own: calls in order, complete if blocking, dropped if not."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from localization.geometry import FloatArray
from localization.types import Pose
from teleop.operator.display.threaded_display import ThreadedDisplay, UnhurriedDisplay


class RecordingDisplay:
    """A display that records its calls, and can be held up."""

    def __init__(self) -> None:
        self.seen: list[object] = []
        self.go = threading.Event()
        self.closed = False

    def show(self, topic: str, message: Mapping[str, Any]) -> None:
        self.go.wait(20)
        self.seen.append((topic, message["n"]))

    def command(self, forward: float, turn: float, deadman: bool, stamp: int) -> None:
        self.seen.append(("command", forward, turn, deadman, stamp))

    def hint(self, map_from_base: Pose, covariance: FloatArray, stamp: int) -> None:
        self.seen.append(("hint", stamp))

    def link(self, *, connected: bool, text: str, stamp: int) -> None:
        self.seen.append(("link", connected, text, stamp))

    def close(self) -> None:
        self.closed = True


def test_blocking_display_gets_every_call_in_order() -> None:
    display = RecordingDisplay()
    threaded = ThreadedDisplay(display, blocking=True, max_pending=3)
    display.go.set()
    for n in range(100):
        threaded.show("/tf", {"n": n})
    threaded.command(0.5, 0.1, True, 7)
    threaded.hint(Pose.identity(), np.zeros((6, 6)), 8)
    threaded.link(connected=False, text="gone", stamp=9)
    threaded.close()
    assert display.seen[:100] == [("/tf", n) for n in range(100)]
    assert display.seen[100:] == [
        ("command", 0.5, 0.1, True, 7),
        ("hint", 8),
        ("link", False, "gone", 9),
    ]
    assert display.closed


def test_hung_display_drops_calls_instead_of_blocking() -> None:
    display = RecordingDisplay()
    threaded = ThreadedDisplay(display, blocking=False, max_pending=5)
    for n in range(1000):
        threaded.show("/tf", {"n": n})
    assert threaded.dropped >= 994
    display.go.set()
    threaded.close()
    assert len(display.seen) == 1000 - threaded.dropped


def test_unhurried_display_draws_what_it_was_called_for_only_when_it_is_given_time() -> None:
    display = RecordingDisplay()
    display.go.set()
    unhurried = UnhurriedDisplay(display)
    unhurried.show("/tf", {"n": 0})
    unhurried.show("/tf", {"n": 1})
    unhurried.draw()
    unhurried.show("/tf", {"n": 2})
    while len(display.seen) < 2:
        time.sleep(0.001)
    time.sleep(0.05)
    assert display.seen == [("/tf", 0), ("/tf", 1)]
    unhurried.close()
    assert display.seen == [("/tf", n) for n in range(3)]
    assert display.closed


def test_unhurried_display_goes_on_after_a_call_that_failed() -> None:
    display = RecordingDisplay()
    display.go.set()
    unhurried = UnhurriedDisplay(display)
    unhurried.show("/tf", {"wrong": 0})
    unhurried.show("/tf", {"n": 1})
    unhurried.close()
    assert display.seen == [("/tf", 1)]
