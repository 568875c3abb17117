"""Headings of key frames as a gyro measured them, for the pose graph.

Over minutes a gyro whose bias is known strays less than scans that are aligned with scans: it knows nothing of walls that
are taken for their other face. What is left of its bias, a hundredth of a degree per second after a rest, and its walk
are unknowns of the graph.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from localization.geometry import FloatArray
from localization.types import IntArray


class GyroHeading(NamedTuple):
    """Heading by the gyro alone since the beginning of a drive."""

    turn: float = 0.0
    """Sum of the turns, less the bias as it was known at the time [rad]; not wrapped."""
    seconds: float = 0.0
    """Time over which the bias acted [s]: not while the robot stood."""
    gaps: int = 0
    """Number of turns that the gyro did not measure."""
    bias: float = 0.0
    """Error of the bias as it is known now, one sigma [rad/s]."""

    def after(
        self, turn: float, seconds: float, bias: float, *, measured: bool = True
    ) -> GyroHeading:
        """Return the heading after another turn [rad] over a time [s], and with another error of the bias [rad/s]."""
        gaps = self.gaps + (not measured)
        return GyroHeading(self.turn + turn, self.seconds + seconds, gaps, bias)


@dataclass(frozen=True, slots=True)
class GyroHeadingConfig:
    """Errors of such headings, one sigma."""

    noise: float = np.deg2rad(0.02)
    """Angle random walk [rad/sqrt(s)], as in ``EkfConfig``."""
    scale: float = 0.003
    """Error of a turn, as a share of it."""
    floor: float = np.deg2rad(0.005)
    """Error from one key frame to the next in addition [rad]."""
    min_bias: float = np.deg2rad(0.005)
    """Least error of a bias that was taken off [rad/s]."""
    bias_walk: float = np.deg2rad(0.003)
    """Its random walk [rad/s/sqrt(s)], as in ``EkfConfig``."""
    others: float = np.deg2rad(0.5)
    """Error of the heading that scans and wheels measured between the same key frames, in addition [rad]. Where they
    err, they do so alike for many key frames, which the graph does not know."""


@dataclass(frozen=True, slots=True, eq=False)
class GyroFactors:
    """Turns between key frames, for a graph with one bias for each turn."""

    source: IntArray
    """Numbers (E,) of the later key frames."""
    target: IntArray
    """Numbers (E,) of the earlier ones."""
    turns: FloatArray
    """Turns (E,) between them [rad]."""
    seconds: FloatArray
    """Times (E,) over which the bias acted [s]."""
    bias: float
    """Error of the bias that was taken off in the first of them, one sigma [rad/s]."""
    config: GyroHeadingConfig
    """Their errors."""

    @classmethod
    def of(
        cls, headings: Sequence[GyroHeading | None], config: GyroHeadingConfig
    ) -> GyroFactors | None:
        """Return the factors between successive key frames; None if there is none."""
        source, turns, seconds = [], [], []
        for k in range(1, len(headings)):
            before, after = headings[k - 1 : k + 1]
            if before is None or after is None or before.gaps != after.gaps:
                continue
            source.append(k)
            turns.append(after.turn - before.turn)
            seconds.append(after.seconds - before.seconds)
        if not source:
            return None
        later, first = np.array(source), headings[source[0]]
        bias = max(config.min_bias, 0.0 if first is None else first.bias)
        return cls(later, later - 1, np.array(turns), np.array(seconds), bias, config)

    def equations(
        self, poses: FloatArray, biases: FloatArray
    ) -> tuple[sparse.coo_matrix, FloatArray]:
        """Return the normal equations of headings and biases at an estimate.

        A turn measures the difference of two headings and the bias times its time; the first bias is as
        uncertain as the filter left it, each next one by what it walked.

        Args:
            poses: Planar poses (K, 3).
            biases: Biases (E,) [rad/s], besides those that were taken off.

        Returns:
            Hessian and gradient, of size 3 K + E: poses first, then biases.
        """
        c, count, first = self.config, len(self.turns), 3 * len(poses)
        of_bias = first + np.arange(count)
        off = poses[self.source, 2] - poses[self.target, 2] - self.turns
        off = np.arctan2(np.sin(off), np.cos(off)) + self.seconds * biases
        variance = c.noise**2 * self.seconds + (c.scale * self.turns) ** 2 + c.floor**2
        walked = np.diff(biases, prepend=0.0)
        steps = c.bias_walk**2 * np.maximum(self.seconds, 1e-3)
        steps[0] = self.bias**2
        rows = np.arange(count)
        ones = np.ones(count)
        index = (
            np.concatenate([rows, rows, rows, count + rows, count + rows[1:]]),
            np.concatenate(
                [3 * self.source + 2, 3 * self.target + 2, of_bias, of_bias, of_bias[:-1]]
            ),
        )
        values = np.concatenate([ones, -ones, self.seconds, ones, -ones[1:]])
        jacobian = sparse.csr_matrix((values, index), shape=(2 * count, first + count))
        trust = 1.0 / np.concatenate([variance, steps])
        weighted = jacobian.multiply(trust[:, None]).tocsr()
        gradient: FloatArray = weighted.T @ np.concatenate([off, walked])
        return (jacobian.T @ weighted).tocoo(), gradient
