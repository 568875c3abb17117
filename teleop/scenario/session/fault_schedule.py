"""Faults that strike between two ticks, and the notes of all faults as they begin."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, Protocol

import numpy as np

from localization.types import SECOND, Hint, Pose
from robot_sim import Simulation, WorldError
from robot_sim.survey.drivable_routes import free_pose
from teleop.robot.inbox import EStop, EStopReset, InboxMessage, PoseHint
from teleop.scenario.files.faults import (
    BoardUnplugged,
    Box,
    ClockStep,
    DoorClosed,
    EStopPressed,
    Fault,
    Kidnap,
    Link,
    OperatorKilled,
    ScannerDead,
    ScannerDirty,
    Walker,
    WheelSlip,
    WrongHint,
)
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.session.places import displaced, pose_of

SECOND_OPERATOR: Final = "a second operator"
"""Name of who gives wrong hints and presses the e-stop."""
_STREAM: Final = 100
"""First stream of draws of the faults; each fault has its own, so that adding one changes no other."""


class OperatorControl(Protocol):
    """What a fault can do to who drives."""

    def kill(self, *, silent: bool) -> None:
        """End the operator: its connection ends too, unless it is silent."""

    def step_clock(self, seconds: float) -> None:
        """Have the operator's clock jump [s]."""


class FaultSchedule:
    """Applies the faults of a scenario at their times; owns which have struck."""

    def __init__(
        self,
        scenario: Scenario,
        simulation: Simulation,
        note: Callable[[str], None],
    ) -> None:
        """Prepare the faults.

        Args:
            scenario: The scenario.
            simulation: The simulated robot in its world.
            note: Called with what happens, for people.
        """
        self.operator: OperatorControl | None = None
        """Who drives; None if nobody of ours does."""

        self._scenario, self._simulation, self._note = scenario, simulation, note
        self._noted: set[str] = set()
        # Of what is due at one instant the ends go first, in the order of the file; but no end before its beginning.
        due: list[tuple[tuple[int, int, int], Fault, bool]] = []
        for i, fault in enumerate(scenario.fault):
            start = round(fault.at * SECOND)
            due.append(((start, 1, 2 * i), fault, False))
            if (lasting := getattr(fault, "lasting", None)) is not None:
                end = round((fault.at + lasting) * SECOND)
                due.append(((end, int(end == start), 2 * i + 1), fault, True))
        self._due = sorted(due, key=lambda each: each[0], reverse=True)

    def apply(self, now: int) -> list[InboxMessage]:
        """Apply what is due; return the messages that others than the operator send by it.

        Args:
            now: Time at which the next tick begins [ns].
        """
        messages: list[InboxMessage] = []
        while self._due and self._due[-1][0][0] <= now:
            (_, _, order), fault, over = self._due.pop()
            messages += self._end(fault) if over else self._begin(order // 2, fault)
        for name in sorted(set(self._simulation.waiting) - self._noted):
            self._note(f"{name} waits until the robot is out of its way")
        self._noted |= set(self._simulation.waiting)
        return messages

    def _begin(self, number: int, fault: Fault) -> list[InboxMessage]:
        self._note(begun(fault))
        match fault:
            case Kidnap():
                self._carry(number, fault)
            case WrongHint():
                truth = self._simulation.truth().map_from_base
                wrong = displaced(
                    truth,
                    fault.off,
                    math.radians(fault.turned),
                    seed=self._scenario.seed,
                    stream=_STREAM + number,
                )
                hint = Hint(self._simulation.stamp, wrong, np.zeros((6, 6)))
                return [PoseHint(SECOND_OPERATOR, hint)]
            case EStopPressed():
                return [EStop(SECOND_OPERATOR)]
            case OperatorKilled() if self.operator is not None:
                self.operator.kill(silent=fault.silent)
            case ClockStep() if self.operator is not None:
                self.operator.step_clock(fault.step)
            case _:
                pass  # the simulated robot, its world or the link knows it from the start
        return []

    def _end(self, fault: Fault) -> list[InboxMessage]:
        self._note(f"over: {begun(fault)}")
        if isinstance(fault, EStopPressed):
            return [EStopReset(SECOND_OPERATOR, admin=True, operator=True)]
        return []

    def _carry(self, number: int, fault: Kidnap) -> None:
        try:
            self._simulation.carry_to(self._destination(number, fault))
        except WorldError as error:
            self._note(f"the robot stays where it is: {error}")

    def _destination(self, number: int, fault: Kidnap) -> Pose:
        world = self._simulation.world
        if fault.to != "anywhere":
            return pose_of(world, fault.to)
        rng = np.random.default_rng(np.random.SeedSequence([self._scenario.seed, _STREAM + number]))
        return free_pose(world, rng)


def begun(fault: Fault) -> str:
    """Return what happens, for people."""
    match fault:
        case Kidnap():
            return f"the robot is carried off to {fault.to}"
        case WheelSlip():
            return f"the wheels turn {fault.factor:g} times as fast as the ground passes"
        case ScannerDead():
            return f"{fault.scanner} is dead"
        case ScannerDirty():
            return f"dirt covers {fault.share:.0%} of {fault.scanner}"
        case BoardUnplugged():
            return "the second arm's board is unplugged"
        case Box():
            return f"a box stands at {fault.to}"
        case Walker():
            return "a person walks by"
        case DoorClosed():
            return f"door {fault.door} is closed"
        case Link():
            parts = [
                f"{name} {value:g}"
                for name in ("delay", "jitter", "rate")
                if (value := getattr(fault, name))
            ]
            return f"link {fault.direction}: {'blackout' if fault.blackout else ', '.join(parts)}"
        case OperatorKilled():
            return "the operator hangs" if fault.silent else "the operator is killed"
        case WrongHint():
            return f"{SECOND_OPERATOR} gives a hint {fault.off:g} m off"
        case ClockStep():
            return f"the operator's clock jumps by {fault.step:g} s"
        case EStopPressed():
            return f"{SECOND_OPERATOR} presses the e-stop"
