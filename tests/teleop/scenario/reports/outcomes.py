"""An outcome made by hand, for the tests of the reports: a drive around a block, with faults and odd names."""

from dataclasses import replace

import numpy as np

from localization.geometry import FloatArray
from localization.types import SECOND
from teleop.scenario.files.reading import scenario_from
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.outcome import (
    Event,
    EventKind,
    ExitStatus,
    LimitCheck,
    Outcome,
    TimeLines,
)

EVIL = "</script><script>alert(1)</script>\x1b[2J\x00\u202e\"'&<b>"
"""A name that somebody gave from the wire."""

SCENARIO = {
    "format": 1,
    "name": "kidnapped-in-the-office",
    "description": "The robot is carried off while it drives; it must notice within two seconds <and> say so.",
    "seed": 7,
    "mission": {
        "goals": [{"at": "library"}, {"at": [8.0, 2.0]}, {"at": "kitchen"}],
        "time_limit": 60.0,
    },
    "fault": [
        {"kind": "kidnap", "at": 30.0},
        {"kind": "link", "at": 10.0, "lasting": 5.0, "delay": 0.5},
    ],
    "limits": {"position_max": 0.1, "contacts": 0, "nees": [2.0, 12.0]},
}


def scenario() -> Scenario:
    """Return the scenario of the outcome."""
    return scenario_from(SCENARIO)


def time_lines(seconds: float = 60.0, *, seed: int = 3) -> TimeLines:
    """Return figures of a drive with a kidnapping in its middle; without an estimate in its first second."""
    count = int(seconds * 50)
    rng = np.random.default_rng(seed)
    time = np.arange(1, count + 1) / 50.0
    phase = 2.0 * np.pi * time / seconds
    true = np.column_stack([13 + 10 * np.cos(phase), 8 + 6 * np.sin(phase), phase + np.pi / 2])
    offset = 0.03 * _smooth(rng.standard_normal((count, 2)))
    lost = (phase > np.pi) & (phase < 1.2 * np.pi)
    offset[lost] += 4.0
    estimated = true + np.column_stack([offset, np.zeros(count)])
    sigma = 0.02 + 0.01 * np.sin(5 * phase) ** 2 + 0.8 * (lost & (phase > 1.05 * np.pi))
    estimated[:50], sigma[:50] = np.nan, np.nan
    error = np.hypot(*(estimated - true)[:, :2].T)
    health = np.where(lost & (phase > 1.05 * np.pi), "lost", "tracking")
    health[:50] = "waiting"
    control = np.where(np.abs(time - 12.5) < 1.5, "disarmed", "armed")
    speed = np.column_stack([np.full(count, 0.6), np.full(count, 2 * np.pi / seconds)])
    command = speed + [0.02, 0.0]
    command[np.abs(time - 12.5) < 1.5] = 0.0
    return TimeLines(
        stamps=(np.arange(1, count + 1) * (SECOND // 50)),
        true=true,
        estimated=estimated,
        error=error,
        sigma=sigma,
        nees=6.0 * (error / sigma) ** 2 / 2.0,
        health=tuple(health.tolist()),
        control=tuple(control.tolist()),
        command=command,
        speed=speed + 0.03 * rng.standard_normal((count, 2)),
        tilt=np.abs(0.01 * rng.standard_normal(count)),
    )


def _smooth(noise: FloatArray) -> FloatArray:
    return np.cumsum(noise, axis=0) / np.sqrt(np.arange(1, len(noise) + 1))[:, None]


def outcome(*, seconds: float = 60.0, status: ExitStatus = ExitStatus.MISSED) -> Outcome:
    """Return an outcome with missed limits, odd texts and figures that are no numbers."""
    lines = time_lines(seconds)
    return Outcome(
        scenario=scenario(),
        status=status,
        ending="time is up",
        checks=(
            LimitCheck("goals", "goals reached", 2.0, "3", "", met=False),
            LimitCheck(
                "position_max", "largest error of the position", 5.66, "<= 0.1", "m", met=False
            ),
            LimitCheck("contacts", "contacts with obstacles", 0.0, "<= 0", "", met=True),
            LimitCheck("nees", "mean NEES", float("nan"), "2 to 12", "", met=False),
            LimitCheck("violations", "violations", 0.0, "<= 0", "", met=True),
        ),
        events=(
            _event(lines, 2.0, EventKind.CLIENT, f"client 1 ({EVIL}) connected"),
            _event(lines, 10.0, EventKind.FAULT, "the link is delayed by 0.5 s for 5 s"),
            _event(lines, 11.0, EventKind.STOP, "the watchdog stopped the robot"),
            _event(lines, 20.0, EventKind.GOAL, "goal 1 of 3 (library) is reached"),
            _event(lines, 30.0, EventKind.FAULT, "the robot is carried off by 5.7 m"),
            _event(lines, 31.5, EventKind.HEALTH, "tracking -> lost"),
            _event(lines, 35.0, EventKind.HINT, "a hint of the operator is accepted"),
            _event(lines, 36.0, EventKind.HEALTH, "lost -> tracking"),
            _event(lines, 40.0, EventKind.VIOLATION, "client 1 called /sim/step"),
            _event(lines, 45.0, EventKind.CONTACT, "the robot touches the cupboard"),
            _event(lines, 50.0, EventKind.GOAL, "goal 2 of 3 is reached"),
        ),
        lines=lines,
        command_ages=np.abs(np.random.default_rng(5).normal(0.08, 0.05, 550)),
        figures={"distance": 52.3, "position_max": 5.66, "nees": float("nan"), "lost": 4.5},
        sha256="5f" * 32,
        pace="lockstep",
        factor=4.7,
        replay="farsteer scenario replay runs/kidnapped-in-the-office",
    )


def passed() -> Outcome:
    """Return the outcome with all limits met."""
    made = outcome(status=ExitStatus.PASSED)
    checks = tuple(replace(c, met=True, value=0.05) for c in made.checks)
    return replace(made, checks=checks, ending="all goals are reached")


def _event(lines: TimeLines, at: float, kind: EventKind, text: str) -> Event:
    tick = min(int(at * 50), len(lines.stamps)) - 1
    return Event(round(at * SECOND), kind, text, *map(float, lines.true[tick, :2]))
