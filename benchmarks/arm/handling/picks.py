"""Boxes that are picked from a shelf and placed over the wire: by planned moves, and by a hand with noise and delay."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.common.figures import Figure, share
from benchmarks.common.progress import with_progress
from localization.types import SECOND, Pose
from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.inverse import solutions
from robot_sim.arm.kinematics import Kinematics
from teleop.robot.arm.arm_commands import Hand
from teleop.robot.arm.arm_state import ArmMode
from teleop.robot.inbox import ArmWish
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.reading import scenario_from
from teleop.scenario.operators.wire import CLOCK_OFFSET
from teleop.scenario.referee.outcome import Outcome
from teleop.scenario.session.run import run_scenario

PICKS = 50
REACHES = 40
HAND = {"noise": 0.002, "unrest": 0.5, "reaction": 0.25}
DELAY = 0.1
"""Time that each message takes, to the robot and back [s]: 200 ms until a hand's motion is seen."""
START = (8.0, 6.0)
"""Where the robot stands in the courtyard, looking along x [m]."""
FOOT = (8.29, 6.0, 0.2)
"""Foot of the arm [m]."""
BOX = 0.03
"""Edge of what is picked [m]."""
MOVED = 1e-4
"""Way of hand and tip that counts as moved [m]."""
RAISE = {
    "kind": "joints",
    "times": [0, 2.5],
    "angles": [[0, 30, -120, 0, 0], [0, 100, -110, 0, -20]],
}
"""From its stow pose the arm is raised, before it comes from above: the gripper may touch what can be picked up."""
KINEMATICS = Kinematics(load_arm())


def picks() -> Iterator[Figure]:
    """Yield how many boxes are placed, and how soon the tip moves after the hand does."""
    for method, traits, link, least in (
        ("planned moves", {"planned": True}, 0.0, PICKS),
        ("hand, 2 mm noise, 200 ms", HAND, DELAY, PICKS - 2),
    ):
        outcomes = [
            one(seed, traits, link)
            for seed in with_progress(range(PICKS), PICKS, f"picks, {method}")
        ]
        case, figures = "box of 30 mm from a shelf onto a crate", [o.figures for o in outcomes]
        placed = sum(f["placed"] == 1.0 and f["dropped"] == 0.0 for f in figures)
        yield share(case, method, "placed", placed, PICKS, least=100.0 * least / PICKS)
        touched = sum(f["arm_contacts"] for f in figures)
        yield Figure(case, method, "contacts of the arm", touched, n=PICKS)
        slips = 1e3 * np.array([f["slip"] for f in figures])
        yield Figure(case, method, "slip p95", float(np.percentile(slips, 95)), "mm", PICKS)
        times = [f["duration"] for f in figures]
        yield Figure(case, method, "time p50", float(np.median(times)), "s", PICKS)
    yield from first_motions()


def one(seed: int, traits: dict[str, Any], link: float) -> Outcome:
    """Pick a box somewhere in reach up and place it elsewhere."""
    rng = np.random.default_rng([25, seed])
    while True:
        away, aside, height = (
            rng.uniform(0.23, 0.31),
            rng.uniform(-0.08, 0.08),
            rng.uniform(0.05, 0.3),
        )
        down, beside = rng.uniform(45.0, 70.0), rng.choice((-1.0, 1.0)) * rng.uniform(0.17, 0.22)
        # Above the middle, so that the fingers keep off the shelf.
        at = [away, aside, height + 0.02 - FOOT[2]]
        put = [rng.uniform(0.15, 0.22), beside, at[2] - 0.01]
        above = [[*spot[:2], spot[2] + 0.07] for spot in (at, put)]
        if all(_in_reach(spot, down) for spot in (at, put, *above)):
            break
    crate = [FOOT[0] + put[0], FOOT[1] + put[1]]
    document = {
        "format": 1,
        "name": "pick",
        "seed": seed,
        "world": {
            "scene": "courtyard",
            "scanner": "none",
            "arm": "s2",
            "parcels": [
                {
                    "name": "box",
                    "at": [
                        FOOT[0] + away,
                        aside + FOOT[1],
                        np.degrees(np.arctan2(aside, away)) + rng.uniform(-15, 15),
                    ],
                    "z": height,
                    "mass": rng.uniform(0.01, 0.04),
                }
            ],
        },
        "mission": {
            "time_limit": 60,
            "deliver": [
                {"parcel": "box", "to": [*crate, height - 0.01 + 0.5 * BOX], "within": 0.03}
            ],
        },
        "operator": {
            "kind": "hand",
            **traits,
            "tasks": [
                {"kind": "grip", "opening": 0.06},
                RAISE,
                {"kind": "pick", "at": at, "down": down},
                {"kind": "put", "at": put, "down": down},
            ],
        },
        "fault": [
            _box([FOOT[0] + away + 0.02, FOOT[1] + aside], [0.1, 0.1, height]),
            _box(crate, [0.12, 0.12, height - 0.015]),
            *([{"kind": "link", "at": 1, "delay": link}] if link else []),
        ],
    }
    return run_scenario(scenario_from(document))


def _box(to: list[float], size: list[float]) -> dict[str, Any]:
    return {"kind": "box", "at": 0, "to": to, "size": [max(0.05, side) for side in size]}


def _in_reach(spot: list[float], down: float) -> bool:
    pose = Pose.from_euler(spot, pitch=np.radians(down), yaw=float(np.arctan2(spot[1], spot[0])))
    return len(solutions(KINEMATICS, pose.position, pose.rotation[:, 0])) > 0


def first_motions() -> Iterator[Figure]:
    """Yield the time from where a hand has moved to where the tip has, as commanded and as measured."""
    rng = np.random.default_rng(25)
    spots = [
        [
            float(rng.uniform(0.2, 0.3)),
            float(rng.uniform(-0.12, 0.12)),
            float(rng.uniform(-0.05, 0.15)),
        ]
        for _ in range(REACHES)
    ]
    tasks = [{"kind": "reach", "to": spot, "down": 45} for spot in spots]
    document = {
        "format": 1,
        "name": "reaches",
        "world": {"scene": "courtyard", "scanner": "none", "arm": "s2"},
        "mission": {"time_limit": 600},
        "operator": {
            "kind": "hand",
            "noise": 0,
            "unrest": 0,
            "tasks": [{"kind": "move", "to": "ready"}, *tasks],
        },
    }
    watch = Watch()
    run_scenario(scenario_from(document), observers=[watch.take])
    case = "hand to first motion, 0.1 mm each"
    for method, found in (("commanded", watch.commanded), ("measured", watch.measured)):
        late = 1e3 * np.array(found)
        goal = 60.0 if method == "commanded" else None
        yield Figure(case, method, "p50", float(np.median(late)), "ms", len(late))
        yield Figure(
            case, method, "p95", float(np.percentile(late, 95)), "ms", len(late), most=goal
        )


class Watch:
    """Notes when a hand begins to move, and when the tip does."""

    def __init__(self) -> None:
        self.commanded: list[float] = []
        self.measured: list[float] = []
        self._rests: dict[str, Any] = {}
        self._previous: Hand | None = None
        self._rest: Hand | None = None
        self._begun: int | None = None

    def take(self, tick: TickRecord) -> None:
        """Take a tick."""
        arm = tick.drive.arm
        assert arm is not None
        for message in tick.inbox:
            if isinstance(message, ArmWish) and isinstance(message.wish, Hand):
                self._observe(message.wish)
        angles = {"commanded": arm.wanted, "measured": arm.angles}
        places = {name: KINEMATICS.tip(each)[:3, 3] for name, each in angles.items()}
        if self._begun is None:
            self._rests = places
        elif arm.mode is ArmMode.HAND:
            for name, rest in list(self._rests.items()):
                if np.linalg.norm(places[name] - rest) > MOVED:
                    getattr(self, name).append((tick.stamp - self._begun) / SECOND)
                    del self._rests[name]

    def _observe(self, hand: Hand) -> None:
        """Note whether the hand rests, and when it has moved from there."""
        before, self._previous = self._previous, hand
        still = before is not None and np.array_equal(hand.pose.position, before.pose.position)
        if still or not hand.engaged or self._rest is None:
            self._rest, self._begun = hand, None
        elif self._begun is None:
            way = float(np.linalg.norm(hand.pose.position - self._rest.pose.position))
            self._begun = hand.stamp - CLOCK_OFFSET if way > MOVED else None
