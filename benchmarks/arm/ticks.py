"""What a hand that moves the arm costs: the control alone among boxes, the arm's share of a tick, and the whole loop."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from benchmarks.arm.boxes import boxes, free_poses, on_a_floor
from benchmarks.arm.campaign import reaches
from benchmarks.arm.parked import posture
from benchmarks.arm.paths import KINEMATICS, TABLE
from benchmarks.common.figures import OURS, Figure
from localization import prepare
from localization.types import Pose
from robot_sim import WorldOptions, load_world
from teleop.robot.arm.arm_commands import Hand
from teleop.robot.arm.hand_control import HandControl
from teleop.robot.arm.limits import Motion
from teleop.robot.assembly import RobotParts, build_stepped_robot
from teleop.robot.inbox import ArmWish, InboxMessage
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.stepped_robot import SteppedRobot
from teleop.robot.tick_record import TickRecord
from teleop.scenario.operators.simulated_hand import SimulatedHand
from teleop.scene_clouds import load_scene_cloud

SCENES, TICKS = 10, 400
DRIVEN = 1500
SCENE = "office"


def ticks() -> Iterator[Figure]:
    """Yield times of ticks in which a hand moves the arm; CPU times, which other work on the machine changes less."""
    yield from _control()
    yield from _robot()


def _control() -> Iterator[Figure]:
    clearance, spent = on_a_floor(), []
    for seed in range(SCENES):
        chance = np.random.default_rng([9, seed])
        clearance.surround(boxes(chance))
        start = next(free_poses(clearance, chance))
        control, motion = HandControl(TABLE, clearance), Motion.at_rest(start)
        for hand in reaches(KINEMATICS.tip(start), chance, TICKS):
            begun = time.thread_time()
            motion = control.tick(hand, motion).motion
            spent.append(time.thread_time() - begun)
    case = "hand control among 12 boxes, the vehicle and a floor"
    yield from _times(case, spent)


def _robot() -> Iterator[Figure]:
    """Drive the whole robot, localiser and server in one thread, while a hand moves its arm."""
    cloud = load_scene_cloud(SCENE)
    world = load_world(SCENE, options=WorldOptions(arm="s2"))
    spent: dict[str, float] = defaultdict(float)

    @contextmanager
    def stage(name: str) -> Iterator[None]:
        begun = time.thread_time()
        yield
        spent[name] += time.thread_time() - begun

    robot = build_stepped_robot(
        RobotParts(world, seed=0),
        cloud,
        prepare(cloud),
        ServeConfig(port=0, lockstep=True),
        stage=stage,
    )
    hand = _Hand(robot)
    of_arm, begun, wall = [], time.process_time(), time.perf_counter()
    for _ in range(DRIVEN):
        before = spent["arm"]
        hand.see(robot.tick())
        of_arm.append(spent["arm"] - before)
    cpu, wall = time.process_time() - begun, time.perf_counter() - wall
    case = f"a robot in {SCENE}, whose arm a hand moves"
    yield from _times(case, of_arm, 0.7, 2.0)
    simulated = DRIVEN * 0.02
    yield Figure(
        case, OURS, "whole loop, CPU time", simulated / cpu, "x real time", DRIVEN, least=6.0
    )
    yield Figure(case, OURS, "whole loop, elapsed time", simulated / wall, "x real time", DRIVEN)


class _Hand:
    """The only client of a robot: a person's hand that leads the tip from place to place."""

    def __init__(self, robot: SteppedRobot) -> None:
        self._robot, self._chance = robot, np.random.default_rng(3)
        self._hand, self._next = SimulatedHand(np.random.default_rng(4)), robot.stamp
        self._sample = self._hand.sample(self._next)
        robot.inbox = self._inbox

    def see(self, tick: TickRecord) -> None:
        """Look at the tip, and want it elsewhere if it is where it was wanted."""
        arm = tick.drive.arm
        assert arm is not None
        self._hand.see(arm.tip)
        if self._hand.settled:
            goal = KINEMATICS.tip(posture(int(self._chance.integers(1, 100))))
            pose = Pose.from_rotation(goal[:3, 3], goal[:3, :3])
            self._hand.aim(pose, self._robot.stamp)

    def _inbox(self) -> Sequence[InboxMessage]:
        while self._next <= self._robot.stamp:
            self._sample = self._hand.sample(self._next)
            self._next += self._hand.traits.period
        sample = self._sample
        hand = Hand(sample.pose, sample.engaged, sample.trigger, stamp=sample.stamp + 1)
        return [ArmWish("hand", hand, arrival=self._robot.stamp)]


def _times(
    case: str, spent: Sequence[float], middle: float | None = None, late: float | None = None
) -> Iterator[Figure]:
    for percent, most in ((50, middle), (99, late)):
        value = 1e3 * float(np.percentile(spent, percent))
        yield Figure(case, OURS, f"tick, CPU, p{percent}", value, "ms", len(spent), most=most)
