"""Planar pose graph: closed loops, wrong loops, the posterior, heights."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from localization.geometry import FloatArray
from localization.mapping.loop_closure_types import Closure
from localization.mapping.map_accuracy import MapAccuracy, map_accuracy
from localization.mapping.planar_pose import between, compose
from localization.mapping.pose_graph import Edge, solved_graph, solved_heights

STEP = np.diag(np.square([0.02, 0.02, 0.01]))
CLOSED = np.diag(np.square([0.01, 0.01, 0.005]))


def square(side: int = 10) -> FloatArray:
    """True poses every metre around a square, and back to the start."""
    poses = [np.zeros(3)]
    for corner in range(4):
        for k in range(side):
            turn = 0.5 * np.pi if k == side - 1 and corner < 3 else 0.0
            poses.append(compose(poses[-1], np.array([1.0, 0.0, turn])))
    return np.array(poses)


def drifting(truth: FloatArray, seed: int = 0) -> tuple[FloatArray, list[Edge]]:
    rng = np.random.default_rng(seed)
    poses, edges = [truth[0]], []
    for k, (a, b) in enumerate(itertools.pairwise(truth)):
        step = between(a, b) + rng.standard_normal(3) * [0.02, 0.02, 0.01] + [0.0, 0.0, 0.008]
        edges.append(Edge(k + 1, k, step, STEP))
        poses.append(compose(poses[-1], step))
    return np.array(poses), edges


def far(poses: FloatArray, truth: FloatArray) -> float:
    return float(np.hypot(*(poses - truth)[:, :2].T).max())


def closed_loops(truth: FloatArray, count: int) -> list[Edge]:
    """Edges from the last poses of the square to the first ones."""
    ends = ((40 - k, k) for k in range(count))
    return [Edge(b, a, between(truth[a], truth[b]), CLOSED, uncertain=True) for b, a in ends]


def test_loop_of_metres_is_closed() -> None:
    truth = square()
    poses, edges = drifting(truth)
    assert far(poses, truth) > 2.0
    loops = closed_loops(truth, 3)
    graph = solved_graph(poses, edges + loops)
    assert far(graph.poses, truth) < 0.7
    assert graph.weights[-3:].min() > 0.9


def test_wrong_loop_among_right_ones_loses_its_weight() -> None:
    truth = square()
    poses, edges = drifting(truth)
    loops = closed_loops(truth, 4)
    right = solved_graph(poses, edges + loops).poses
    wrong = Edge(30, 5, np.array([0.3, 0.0, 0.0]), CLOSED, uncertain=True)
    graph = solved_graph(poses, [*edges, *loops, wrong])
    assert graph.weights[-1] < 0.01
    assert np.hypot(*(graph.poses - right)[:, :2].T).max() < 0.05


def test_covariance_is_that_of_the_chain_and_shrinks_by_a_loop() -> None:
    straight = np.array([(float(x), 0.0, 0.0) for x in range(11)])
    edges = [Edge(k + 1, k, np.array([1.0, 0.0, 0.0]), STEP) for k in range(10)]
    graph = solved_graph(straight, edges)
    own = graph.covariance_columns(10)[10]
    assert own[0, 0] == pytest.approx(10 * 0.02**2, rel=1e-3)
    assert own[2, 2] == pytest.approx(10 * 0.01**2, rel=1e-3)
    # Headings on the way swing the end sideways: the sum of squares of the ways that are left.
    swung = sum(k**2 for k in range(10)) * 0.01**2
    assert own[1, 1] == pytest.approx(10 * 0.02**2 + swung, rel=1e-3)
    loop = Edge(10, 0, np.array([10.0, 0.0, 0.0]), CLOSED, uncertain=True)
    closed = solved_graph(straight, [*edges, loop]).covariance_columns(10)[10]
    assert closed[1, 1] < 0.01 * own[1, 1]


def test_heights_are_closed_too() -> None:
    heights = np.array([0.0, 0.1, 0.2, 0.3])
    solved = solved_heights(
        heights,
        np.array([1, 2, 3, 3]),
        np.array([0, 1, 2, 0]),
        np.array([0.1, 0.1, 0.1, 0.0]),
        np.array([0.01, 0.01, 0.01, 1e-5]),
    )
    assert solved == pytest.approx([0.0, 0.0, 0.0, 0.0], abs=1e-3)


def accuracy(loops: int, *shifts: FloatArray) -> MapAccuracy:
    """The accuracy of the square's map with so many loops, each closed with every one of some errors (3,)."""
    truth = square()
    poses, edges = drifting(truth)
    closures = [
        Closure(40 - k, k, between(truth[k], truth[40 - k]) + shift, CLOSED, 0.9, False)
        for k in range(loops)
        for shift in shifts or (np.zeros(3),)
    ]
    measured = [Edge(c.later, c.earlier, c.motion, c.covariance, uncertain=True) for c in closures]
    way = 10.0 * np.arange(41.0)
    return map_accuracy(solved_graph(poses, edges + measured), way, closures)


def test_map_without_loops_says_so_and_how_far_it_may_be_bent() -> None:
    bent = accuracy(0)
    assert bent.loops == 0
    assert bent.warning is not None
    assert bent.warning.startswith("no loop in 400 m")
    assert bent.drift > 0.3
    one = accuracy(1)
    assert one.loops == one.closures == 1
    assert one.warning is not None
    assert one.warning.startswith("only one loop in 400 m")
    assert one.drift < 0.7 * bent.drift


def test_noise_covers_closures_that_disagree() -> None:
    shift = np.array([0.025, -0.025, 0.005])
    assert accuracy(4, -shift, shift).position_noise > 1.3 * accuracy(4).position_noise
