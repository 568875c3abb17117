"""Planar pose graph: poses of key frames that agree best with odometry and loop closures.

Gauss-Newton on sparse normal equations. Closures that disagree with the rest lose their weight by dynamic
covariance scaling (Agarwal et al., ICRA 2013): an edge whose squared, normalised error is far above the gate hardly
pulls, so that one wrong loop cannot bend the map. The gate begins above the largest error and shrinks (graduated
non-convexity, Yang et al., RA-L 2020), since at first all closures disagree with the drifted poses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from localization.geometry import FloatArray
from localization.mapping.gyro_heading import GyroFactors
from localization.types import IntArray

GATE = 16.0
"""Squared, normalised error at which the weight of an uncertain edge begins to fall. A correct loop has 3 on average
with three degrees of freedom, and one of 900 has more than this."""
_HELD = 1e12
"""Information that keeps the first pose fixed."""
_ITERATIONS = 50
"""Number of iterations at most."""
_STEP = 1e-6
"""Step at which the optimisation ends [m, rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """Measured planar pose of one node in another."""

    source: int
    """Number of the node whose pose was measured."""
    target: int
    """Number of the node in whose frame it was measured."""
    motion: FloatArray
    """Planar pose (3,) of the source in the target."""
    covariance: FloatArray
    """Covariance (3, 3) of x, y and yaw in the source's axes [m, rad]."""
    uncertain: bool = False
    """Whether the edge may be wrong, so that the optimisation may take its weight away."""


@dataclass(frozen=True, slots=True, eq=False)
class SolvedGraph:
    """Poses that agree best with the edges."""

    poses: FloatArray
    """Planar poses (K, 3) of the nodes."""
    errors: FloatArray
    """Errors (E, 3) of the edges at these poses, in the sources' axes [m, rad]."""
    weights: FloatArray
    """Weight (E,) of each edge in [0, 1]; 1 for certain edges."""
    _factor: SuperLU

    def covariance_columns(self, node: int) -> FloatArray:
        """Return the covariance (K, 3, 3) of every node's pose with that of one node, in the map's axes."""
        size = 3 * len(self.poses)
        unit = np.zeros((self._factor.shape[0], 3))
        unit[3 * node + np.arange(3), np.arange(3)] = 1.0
        columns: FloatArray = self._factor.solve(unit)[:size].reshape(-1, 3, 3)
        return columns


def solved_graph(
    poses: FloatArray, edges: Sequence[Edge], gyro: GyroFactors | None = None
) -> SolvedGraph:
    """Return the planar poses that agree best with the edges; the first pose stays fixed.

    Args:
        poses: Initial planar poses (K, 3).
        edges: Measured relative poses, which connect all nodes.
        gyro: Turns between nodes that a gyro measured, if there was one.
    """
    source, target = (np.array([getattr(e, n) for e in edges]) for n in ("source", "target"))
    motions = np.array([e.motion for e in edges])
    trust = np.linalg.inv(np.array([e.covariance for e in edges]))
    loose = np.array([e.uncertain for e in edges])
    poses = np.array(poses, dtype=float)
    gate = np.inf
    biases = np.zeros(0 if gyro is None else len(gyro.turns))
    for _ in range(_ITERATIONS):
        errors, at_target, at_source = _linearised(poses, source, target, motions)
        largest = float(_squares(errors, trust)[loose].max(initial=0.0))
        gate = max(GATE, min(0.5 * gate, largest))
        weights = _weights(errors, trust, loose, gate)
        weighted = trust * weights[:, None, None]
        hessian, gradient = _normal_equations(
            len(poses), source, target, errors, at_source, at_target, weighted
        )
        if gyro is not None:
            hessian, gradient = _with_headings(hessian, gradient, gyro, poses, biases)
        factor = splu(hessian)
        change = -factor.solve(gradient)
        step = change[: poses.size].reshape(-1, 3)
        poses, biases = poses + step, biases + change[poses.size :]
        if gate == GATE and float(np.abs(step).max()) < _STEP:
            break
    poses[:, 2] = np.arctan2(np.sin(poses[:, 2]), np.cos(poses[:, 2]))
    errors, _, _ = _linearised(poses, source, target, motions)
    return SolvedGraph(poses, errors, _weights(errors, trust, loose, GATE), factor)


def _squares(errors: FloatArray, trust: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ei,eij,ej->e", errors, trust, errors))


def _weights(
    errors: FloatArray, trust: FloatArray, loose: npt.NDArray[np.bool_], gate: float
) -> FloatArray:
    # The scale is that of the error (Agarwal's s), so that information has its square.
    scale = np.minimum(1.0, 2.0 * gate / (gate + _squares(errors, trust)))
    return np.where(loose, scale**2, 1.0)


def _linearised(
    poses: FloatArray, source: IntArray, target: IntArray, motions: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return errors (E, 3) in the sources' axes, and their Jacobians (E, 3, 3) by the targets and the sources."""
    there, here = poses[target], poses[source]
    step = here[:, :2] - there[:, :2]
    # Into the target's axes, and on into those of the measured source.
    c, s = np.cos(there[:, 2] + motions[:, 2]), np.sin(there[:, 2] + motions[:, 2])
    turn = np.stack([np.stack([c, s], axis=-1), np.stack([-s, c], axis=-1)], axis=1)
    # The derivative of the turn by the target's heading.
    bent = np.stack([np.stack([-s, c], axis=-1), np.stack([-c, -s], axis=-1)], axis=1)
    cm, sm = np.cos(motions[:, 2]), np.sin(motions[:, 2])
    x, y = motions[:, 0], motions[:, 1]
    measured = np.column_stack([cm * x + sm * y, cm * y - sm * x])
    yaw = here[:, 2] - there[:, 2] - motions[:, 2]
    errors = np.column_stack(
        [np.einsum("eij,ej->ei", turn, step) - measured, np.arctan2(np.sin(yaw), np.cos(yaw))]
    )
    by_source = np.zeros((len(errors), 3, 3))
    by_source[:, :2, :2] = turn
    by_source[:, 2, 2] = 1.0
    by_target = -by_source
    by_target[:, :2, 2] = np.einsum("eij,ej->ei", bent, step)
    return errors, by_target, by_source


def _normal_equations(
    count: int,
    source: IntArray,
    target: IntArray,
    errors: FloatArray,
    by_source: FloatArray,
    by_target: FloatArray,
    trust: FloatArray,
) -> tuple[sparse.csc_matrix, FloatArray]:
    size = 3 * count
    rows, columns, values = [], [], []
    gradient = np.zeros(size)
    local = np.arange(3)
    for a, by_a in ((source, by_source), (target, by_target)):
        pulled = np.einsum("eji,ejk->eik", by_a, trust)
        # Several edges end at one node: ``+=`` would keep one of them.
        np.add.at(gradient, 3 * a[:, None] + local, np.einsum("eik,ek->ei", pulled, errors))
        for b, by_b in ((source, by_source), (target, by_target)):
            block = np.einsum("eik,ekj->eij", pulled, by_b)
            rows.append(np.broadcast_to(3 * a[:, None, None] + local[:, None], block.shape))
            columns.append(np.broadcast_to(3 * b[:, None, None] + local[None, :], block.shape))
            values.append(block)
    index = (np.concatenate(rows).ravel(), np.concatenate(columns).ravel())
    # Blocks at one place are added up by the conversion.
    hessian = sparse.coo_matrix((np.concatenate(values).ravel(), index), shape=(size, size))
    held = sparse.coo_matrix((np.full(3, _HELD), (local, local)), shape=(size, size))
    return (hessian + held).tocsc(), gradient


def _with_headings(
    hessian: sparse.csc_matrix,
    gradient: FloatArray,
    gyro: GyroFactors,
    poses: FloatArray,
    biases: FloatArray,
) -> tuple[sparse.csc_matrix, FloatArray]:
    """Return the normal equations of poses and gyro biases, given those of the edges."""
    more, pull = gyro.equations(poses, biases)
    edges = hessian.tocoo()
    whole = sparse.coo_matrix((edges.data, (edges.row, edges.col)), shape=more.shape) + more
    pull[: len(gradient)] += gradient
    return whole.tocsc(), pull


def solved_heights(
    heights: FloatArray,
    source: IntArray,
    target: IntArray,
    climbs: FloatArray,
    sigmas: FloatArray,
) -> FloatArray:
    """Return the heights (K,) that agree best with measured differences; the first stays fixed.

    Args:
        heights: Heights (K,) before [m].
        source: Numbers (E,) of the nodes above.
        target: Numbers (E,) of the nodes below.
        climbs: Differences (E,) between the two [m].
        sigmas: Their errors (E,), one sigma [m].
    """
    if not np.ptp(heights) and not np.any(climbs):
        return heights
    edges = np.arange(len(source))
    ones = np.ones(len(source))
    index = (np.concatenate([edges, edges]), np.concatenate([source, target]))
    rows = sparse.csr_matrix(
        (np.concatenate([ones, -ones]), index), shape=(len(edges), len(heights))
    )
    weighted = rows.multiply(1.0 / np.square(sigmas)[:, None]).tocsr()
    size = len(heights)
    held = sparse.coo_matrix(([_HELD], ([0], [0])), shape=(size, size))
    pull = weighted.T @ climbs
    pull[0] += _HELD * heights[0]
    solved: FloatArray = splu((rows.T @ weighted + held).tocsc()).solve(pull)
    return solved
