"""The rule by itself: bounds of its arithmetic, and what holds for any points and speeds."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
from hypothesis import assume, given, settings, strategies as st

from robot_sim import DriveConfig
from teleop.robot.guard.braking import Ramps
from teleop.robot.guard.outline import Outline
from teleop.robot.guard.points import Points
from teleop.robot.guard.rule import Rule
from teleop.robot.guard.settings import CREEP, GuardConfig

CONFIG, DRIVE = GuardConfig(), DriveConfig()
RULE = Rule(
    Outline(0.254, 0.254, 0.2345),
    Ramps(
        (DRIVE.acceleration, DRIVE.turn_acceleration),
        (CONFIG.worn * DRIVE.braking, CONFIG.worn * DRIVE.turn_braking),
    ),
    CONFIG,
)
SPEEDS = st.tuples(st.floats(-0.7, 0.7), st.floats(-2.4, 2.4))
AGES = st.floats(0.0, 1.0)


def points(*xy: tuple[float, float]) -> Points:
    n = len(xy)
    return Points(np.array(xy).reshape(n, 2), np.zeros(n), np.zeros(n, bool), np.zeros(n))


CLOUDS = st.lists(st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)), min_size=1, max_size=12)


def outside(cloud: list[tuple[float, float]], least: float = 0.0) -> Points:
    known = points(*cloud)
    return known.of(RULE.outline.gaps(np.zeros(3), known.xy) > least)


def test_stopping_distance_is_bounded_over_the_whole_box_of_speed_age_lag_and_brakes() -> None:
    """By intervals: in each cell the largest way that brakes can take is less than the least that is kept free."""
    speeds, ages = np.linspace(0.0, DRIVE.max_speed, 41), np.linspace(0.0, 1.0, 65)
    for (v0, v1), (a0, a1) in product(pairwise(speeds.tolist()), pairwise(ages.tolist())):
        reaction = (0.0 + a1 + CONFIG.lag, a0 + CONFIG.lag)
        worst = v1 * reaction[0] + 0.5 * v1 * v1 / (CONFIG.worn * DRIVE.braking)
        motion = RULE.braking((v0, 0.0), np.array([[v0, 0.0]]), reaction[1])
        kept = float(motion.poses[0, -1, 0]) + RULE.margin((v0, 0.0))
        assert worst < kept, (v0, a0)


@given(SPEEDS, SPEEDS, AGES)
def test_no_point_of_the_robot_goes_further_than_the_cheap_bound(
    now: tuple[float, float], command: tuple[float, float], age: float
) -> None:
    motion = RULE.braking(now, np.array([command]), CONFIG.lag + age)
    way, lasts = RULE.bound(now, command, CONFIG.lag + age)
    x, y, yaw = motion.poses[0].T
    # Between samples speeds are taken for straight lines, which a corner of a ramp is not.
    assert (np.hypot(x, y) + RULE.outline.radius * np.abs(yaw) <= way + 0.002).all()
    assert motion.times[0, -1] <= lasts + 1e-9


@given(SPEEDS, SPEEDS, AGES, CLOUDS)
@settings(max_examples=60)
def test_what_is_far_by_the_cheap_bound_is_free_by_the_rule(
    now: tuple[float, float],
    command: tuple[float, float],
    age: float,
    cloud: list[tuple[float, float]],
) -> None:
    way, _ = RULE.bound(now, command, CONFIG.lag + age)
    known = outside(cloud, way + RULE.margin(command) + 0.002)
    share, _, near = RULE.share(now, command, known, reaction=CONFIG.lag + age, scan_age=0.0)
    assert (share, near) == (1.0, None)


@given(SPEEDS, AGES, CLOUDS)
@settings(max_examples=60)
def test_what_is_admitted_never_ends_nearer_than_the_margin_or_than_it_was(
    command: tuple[float, float], age: float, cloud: list[tuple[float, float]]
) -> None:
    known, reaction = outside(cloud), CONFIG.lag + age
    share, _, _ = RULE.share((0.0, 0.0), command, known, reaction=reaction, scan_age=0.0)
    motion = RULE.braking((0.0, 0.0), share * np.array([command]), reaction)
    gaps = RULE.outline.gaps(motion.poses[0], known.xy)
    assert (gaps >= np.minimum(gaps[0], 0.015) - 2e-6).all()


@given(
    st.floats(0.05, 0.7),
    AGES,
    st.floats(-0.23, 0.23),
    st.lists(st.floats(0.3, 2.0), min_size=2, max_size=6),
)
@settings(max_examples=60)
def test_verdict_is_monotone_in_the_distance_of_what_is_ahead(
    speed: float, age: float, y: float, distances: list[float]
) -> None:
    shares = [
        RULE.share(
            (0.0, 0.0), (speed, 0.0), points((x, y)), reaction=CONFIG.lag + age, scan_age=0.0
        )[0]
        for x in sorted(distances)
    ]
    assert shares == sorted(shares)


@given(st.floats(-0.6, 0.6), CLOUDS)
@settings(max_examples=80)
def test_way_back_along_the_arc_just_driven_is_never_closed(
    bend: float, cloud: list[tuple[float, float]]
) -> None:
    """Whatever stands beside the arc or ahead: the robot came past it with the margin at rest."""
    along = np.linspace(0.0, 0.6, 31)
    yaw = -bend * along
    back = np.stack(
        (
            -along * np.sinc(yaw / math.pi),
            along * np.sin(yaw / 2) * -np.sinc(yaw / 2 / math.pi),
            yaw,
        ),
        -1,
    )
    known = points(*cloud)
    beside = RULE.outline.gaps(back, known.xy).min(axis=0)
    known = known.of(beside > CONFIG.margin + 0.003)
    assume(len(known.xy))
    speed = CREEP / (1.0 + RULE.outline.radius * abs(bend))
    assert RULE.admits((-speed, -speed * bend), known, held=False)


@given(CLOUDS, st.floats(-0.1, 0.1).filter(bool), st.floats(-0.2, 0.2))
def test_who_creeps_may_go_straight_on_if_friction_swallows_the_turn(
    cloud: list[tuple[float, float]], forward: float, turn: float
) -> None:
    known = outside(cloud)
    assume(len(known.xy) and abs(forward) + RULE.outline.radius * abs(turn) <= CREEP)
    if RULE.admits((forward, turn), known, held=False):
        assert RULE.admits((forward, 0.0), known, held=False)


@given(SPEEDS, CLOUDS)
@settings(max_examples=60)
def test_robot_stands_before_anybody_who_comes_on_is_there_whichever_way_it_goes(
    command: tuple[float, float], cloud: list[tuple[float, float]]
) -> None:
    people = replace(outside(cloud), moving=np.ones(len(outside(cloud).xy), bool))
    share, _, _ = RULE.share((0.0, 0.0), command, people, reaction=CONFIG.lag, scan_age=0.0)
    assume(share > 0.0 and len(people.xy))
    motion = RULE.braking((0.0, 0.0), share * np.array([command]), CONFIG.lag)
    come = CONFIG.approach * motion.times[0][:, None]
    assert (RULE.outline.gaps(motion.poses[0], people.xy) > come).all()


@given(st.floats(0.0, math.tau), st.floats(0.021, 0.3))
def test_some_way_leads_off_any_single_thing_however_near(bearing: float, gap: float) -> None:
    ray = np.array([math.cos(bearing), math.sin(bearing)])
    distances = np.linspace(0.2, 0.9, 701)
    gaps = RULE.outline.gaps(np.zeros(3), distances[:, None] * ray)
    x, y = (distances[int(np.argmax(gaps >= gap))] * ray).tolist()
    ways = [(CREEP, 0.0), (-CREEP, 0.0), (0.0, 0.3), (0.0, -0.3)]
    assert any(RULE.admits(way, points((x, y)), held=True) for way in ways)


def test_room_along_an_arc_ends_a_margin_before_what_stands_on_it() -> None:
    room = RULE.room((0.5, 0.0), 2.0, points((1.254, 0.0)))
    assert abs(room.length - (1.0 - CONFIG.margin)) < 0.021
    assert room.near is not None
    assert RULE.room((0.5, 0.5), 2.0, points((1.254, -0.2))).near is None
    assert RULE.room((-0.5, 0.0), 2.0, points((1.254, 0.0))).length == 2.0
    turned = RULE.room((0.0, 0.5), 3.0, points((0.0, 0.30)))
    assert 0.0 < turned.length < 0.6
