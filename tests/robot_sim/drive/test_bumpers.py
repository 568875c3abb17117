"""Bumper segments by the bearing of what touches the robot."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from robot_sim.drive.bumpers import SEGMENTS, SPAN, Bumpers, pressed_by

WIDTH = SPAN / SEGMENTS
bearings = st.floats(-math.pi, math.pi)
points = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)).filter(
    lambda p: math.hypot(*p) > 0.01
)


def at(*degrees: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Return points at bearings, 0.3 m from the centre."""
    a = np.radians(degrees)
    return 0.3 * np.stack([np.cos(a), np.sin(a)], axis=1)


def indices(ring: tuple[bool, ...]) -> list[int]:
    return [i for i, pressed in enumerate(ring) if pressed]


def test_flat_thing_presses_what_lies_between_the_ends_of_its_patch() -> None:
    assert indices(pressed_by([at(32.0, -32.0)]).front) == [1, 2, 3]
    assert indices(pressed_by([at(148.0, -148.0)]).rear) == [1, 2, 3]


def test_two_things_press_only_where_they_are() -> None:
    assert indices(pressed_by([at(32.0), at(-32.0)]).front) == [1, 3]


def test_wall_along_the_whole_side_presses_the_outer_segments_of_both_rings_at_most() -> None:
    bumpers = pressed_by([np.array([[0.25, 0.16], [-0.25, 0.16]])])
    assert (indices(bumpers.front), indices(bumpers.rear)) == ([1], [1])


@given(st.lists(points, min_size=1, max_size=4))
def test_mirrored_world_presses_mirrored_segments(patch: list[tuple[float, float]]) -> None:
    here = np.array(patch)
    there = here * [1.0, -1.0]
    # On the border of two segments either may be pressed.
    border = np.abs((np.degrees(np.arctan2(here[:, 1], np.abs(here[:, 0]))) + 13.5) % 27.0)
    if np.minimum(border, 27.0 - border).min() < 1e-6:
        return
    bumpers, mirrored = pressed_by([here]), pressed_by([there])
    assert mirrored.front == bumpers.front[::-1]
    assert mirrored.rear == bumpers.rear[::-1]


@given(bearings)
def test_one_point_presses_the_one_segment_that_faces_it(bearing: float) -> None:
    bumpers = pressed_by([0.3 * np.array([[math.cos(bearing), math.sin(bearing)]])])
    ahead = abs(bearing) < math.pi / 2
    off = abs(bearing) if ahead else math.pi - abs(bearing)
    found = indices(bumpers.front) + indices(bumpers.rear)
    if abs(off - SPAN / 2) > 1e-9:
        assert len(found) == (1 if off < SPAN / 2 else 0)
    if found:
        # Middle of that segment, from the robot's left to its right on either ring.
        middle = SPAN / 2 - (found[0] + 0.5) * WIDTH
        aside = bearing if ahead else math.remainder(math.pi - bearing, math.tau)
        assert abs(aside - middle) <= WIDTH / 2 + 1e-9


def test_pressed_in_either_is_pressed_in_both_together() -> None:
    both = pressed_by([at(0.0)]) | pressed_by([at(180.0)])
    assert (indices(both.front), indices(both.rear)) == ([2], [2])
    assert both.pressed
    assert not Bumpers().pressed


def test_ring_of_another_length_is_rejected() -> None:
    with pytest.raises(ValueError, match="5 segments"):
        Bumpers(front=(True,))
