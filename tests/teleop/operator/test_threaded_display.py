"""The display's thread: in order, complete if patient, never in the way if not."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Any

import numpy as np

from localization.geometry import FloatArray
from localization.types import Pose
from teleop.operator.threaded_display import ThreadedDisplay


class Slate:
    """A display that writes down what it is told, when it is let."""

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


def test_patient_display_gets_everything_in_order_and_is_closed_at_the_end() -> None:
    slate = Slate()
    aside = ThreadedDisplay(slate, blocking=True, max_pending=3)
    slate.go.set()
    for n in range(100):
        aside.show("/tf", {"n": n})
    aside.command(0.5, 0.1, True, 7)
    aside.hint(Pose.identity(), np.zeros((6, 6)), 8)
    aside.link(connected=False, text="gone", stamp=9)
    aside.close()
    assert slate.seen[:100] == [("/tf", n) for n in range(100)]
    assert slate.seen[100:] == [
        ("command", 0.5, 0.1, True, 7),
        ("hint", 8),
        ("link", False, "gone", 9),
    ]
    assert slate.closed


def test_impatient_display_that_hangs_leaves_out_instead_of_holding_up() -> None:
    slate = Slate()
    aside = ThreadedDisplay(slate, blocking=False, max_pending=5)
    for n in range(1000):
        aside.show("/tf", {"n": n})
    assert aside.dropped >= 994
    slate.go.set()
    aside.close()
    assert len(slate.seen) == 1000 - aside.dropped
