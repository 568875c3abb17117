"""Two trees of poses that grow towards each other until a way joins them (RRT-Connect, Kuffner and LaValle, 2000)."""

from __future__ import annotations

from collections.abc import Generator
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from robot_sim.arm.arm_table import JOINTS
from teleop.robot.arm.clear_ways import ClearWays

_STRIDE: Final = 0.5
"""Length of the longest branch [rad]."""


class Tree:
    """Poses from which there is a free way to a root."""

    def __init__(self, roots: FloatArray) -> None:
        """Take roots (N, 5) [rad]."""
        self._poses = np.empty((max(256, 2 * len(roots)), JOINTS))
        self._poses[: len(roots)] = roots
        self._parents = [-1] * len(roots)

    def __len__(self) -> int:
        return len(self._parents)

    def __getitem__(self, node: int) -> FloatArray:
        """Return the pose (5,) of a node."""
        pose: FloatArray = self._poses[node]
        return pose

    def nearest(self, angles: FloatArray) -> int:
        """Return the node nearest to a pose (5,)."""
        apart = self._poses[: len(self)] - angles
        return int(np.einsum("nj,nj->n", apart, apart).argmin())

    def add(self, angles: FloatArray, parent: int) -> int:
        """Add a pose (5,) behind another node; return its node."""
        node = len(self)
        if node == len(self._poses):
            self._poses = np.concatenate((self._poses, np.empty_like(self._poses)))
        self._poses[node] = angles
        self._parents.append(parent)
        return node

    def way_from(self, node: int) -> list[FloatArray]:
        """Return the poses from a node to its root."""
        way = []
        while node >= 0:
            way.append(self._poses[node].copy())
            node = self._parents[node]
        return way


def connect(
    ways: ClearWays,
    ends: tuple[FloatArray, FloatArray],
    limits: tuple[FloatArray, FloatArray],
    chance: np.random.Generator,
) -> Generator[None, None, list[FloatArray]]:
    """Search a way until there is one; who asks decides how long.

    Args:
        ways: What checks ways.
        ends: Poses (N, 5) where it may begin and (M, 5) where it may end [rad].
        limits: Smallest and largest angles (5,) [rad].
        chance: Source of the poses towards which the trees grow.

    Yields:
        Whenever the budget is used up.

    Returns:
        Poses (5,), from one of the first to one of the last.
    """
    trees = [Tree(ends[0]), Tree(ends[1])]
    grown = 0
    while True:
        own, other = trees[grown], trees[1 - grown]
        aim = chance.uniform(*limits)
        node = yield from _grow(ways, own, aim, once=True)
        if node is not None:
            reached = yield from _grow(ways, other, own[node], once=False)
            if reached is not None and np.array_equal(other[reached], own[node]):
                halves = own.way_from(node), other.way_from(reached)
                first, last = halves if grown == 0 else halves[::-1]
                return first[::-1] + last[1:]
        grown = 1 - grown
        if ways.spent:
            yield


def _grow(
    ways: ClearWays, tree: Tree, aim: FloatArray, *, once: bool
) -> Generator[None, None, int | None]:
    """Grow a tree towards a pose, by one branch or until it is reached or blocked; return the last new node."""
    node, added = tree.nearest(aim), None
    while True:
        begin = tree[node]
        apart = aim - begin
        distance = float(np.linalg.norm(apart))
        if distance == 0.0:
            return node
        there = aim if distance <= _STRIDE else begin + (_STRIDE / distance) * apart
        if not ways.pose(there):
            return added
        if not (yield from ways.straight(begin, there)):
            return added
        node = added = tree.add(there, node)
        if once:
            return added
