"""Beam pattern of a sweep: origin and direction of each beam at that beam's own time."""

from __future__ import annotations

import numpy as np

from localization.types import IntArray, Pose
from robot_sim.array_types import FloatArray
from robot_sim.sensors.pose_history import PoseHistory


class BeamPattern:
    """Beams in the scanner's x-y plane at fixed angles and fixed times after the sweep's start.

    Origin and plane of the scanner are computed at each physics step and interpolated in between. Both
    are matrix products, the second with weights that are the same for every sweep; a rotation for each
    beam would cost many times as much. At the highest turning rate, 10 mrad per step, directions are
    exact to 5e-6 rad.
    """

    def __init__(self, mount: Pose, angles: FloatArray, offsets: IntArray) -> None:
        """Lay out the beams.

        Args:
            mount: ``base_from_scanner``.
            angles: (N,) from the scanner's x axis [rad].
            offsets: (N,) times after the first beam [ns], not decreasing.
        """
        x, y = mount.rotation[:, 0], mount.rotation[:, 1]
        turned = [np.einsum("abij,j->abi", _ROTATION, v) for v in (mount.position, x, y)]
        # The rotated origin and axes of the mount are linear in the products of a quaternion's parts.
        self._frame_of = np.ascontiguousarray(np.concatenate(turned, axis=2).reshape(16, 9).T)
        self._cosines = np.cos(angles)
        self._sines = np.sin(angles)
        self._offsets = offsets
        self._phase = -1
        self._weights: FloatArray = np.zeros((0, len(offsets)))

    def rays(self, track: PoseHistory, start: int) -> tuple[FloatArray, FloatArray]:
        """Return origins (N, 3) [m] and unit directions (N, 3), in ``map``, stored by columns.

        Args:
            track: Poses from ``start`` or earlier to the last beam or later.
            start: Time of the first beam [ns].
        """
        at = self._blended(track, start)
        directions = _unit(self._cosines * at[3:6] + self._sines * at[6:])
        return at[:3].T, directions.T

    def axes(self, track: PoseHistory, start: int) -> tuple[FloatArray, FloatArray]:
        """Return origins (N, 3) [m] and axes (N, 3, 3), in ``map``; arguments as for ``rays``.

        The columns of a matrix of axes are the beam's direction, left and up.
        """
        at = self._blended(track, start)
        axes = np.empty((3, 3, len(self._offsets)))
        axes[0] = _unit(self._cosines * at[3:6] + self._sines * at[6:])
        axes[1] = _unit(self._cosines * at[6:] - self._sines * at[3:6])
        (x, y, z), (u, v, w) = axes[0], axes[1]
        axes[2] = y * w - z * v, z * u - x * w, x * v - y * u
        return np.ascontiguousarray(at[:3].T), np.ascontiguousarray(axes.transpose(2, 1, 0))

    def _blended(self, track: PoseHistory, start: int) -> FloatArray:
        """Return (9, N): origin, x axis and y axis of the scanner at each beam's time."""
        stamps = track.stamps
        step = int(stamps[1] - stamps[0])
        first, phase = divmod(start - int(stamps[0]), step)
        if phase != self._phase:
            self._weights = _weights(phase + self._offsets, step)
            self._phase = phase
        q = track.quaternions_wxyz[first : first + len(self._weights)]
        frames = self._frame_of @ (q[:, :, None] * q[:, None, :]).reshape(-1, 16).T
        frames[:3] += track.positions[first : first + len(q)].T
        # The last beam may coincide with the last step: a step after it has no weight.
        return np.asarray(frames @ self._weights[: len(q)])


def _weights(times: IntArray, step: int) -> FloatArray:
    """Return weights (K, N) of physics steps for beams at ``times`` (N,) [ns] after the first step.

    Only the steps before and after a beam have a weight.
    """
    before, late = np.divmod(times, step)
    beams, shares = np.arange(len(times)), late / step
    weights = np.zeros((int(before[-1]) + 2, len(times)))
    weights[before, beams] = 1.0 - shares
    weights[before + 1, beams] = shares
    return weights


def _unit(vectors: FloatArray) -> FloatArray:
    """Normalise vectors (3, N); interpolated axes are short by at most 1e-5: one Newton step."""
    squares = np.add.reduce(vectors * vectors)
    squares *= -0.5
    squares += 1.5
    vectors *= squares
    return vectors


def _rotation_tensor() -> FloatArray:
    """Return T (4, 4, 3, 3) such that ``sum_ab T[a, b] q_a q_b`` is the rotation matrix of q, wxyz."""
    tensor = np.zeros((4, 4, 3, 3))
    w, x, y, z = range(4)
    for a, signs in ((w, (1, 1, 1)), (x, (1, -1, -1)), (y, (-1, 1, -1)), (z, (-1, -1, 1))):
        tensor[a, a] = np.diag(signs)
    for a, b, row, column in ((x, y, 0, 1), (x, z, 0, 2), (y, z, 1, 2)):
        tensor[a, b, row, column] = tensor[a, b, column, row] = 2.0
    for a, row, column in ((x, 2, 1), (y, 0, 2), (z, 1, 0)):
        tensor[w, a, row, column], tensor[w, a, column, row] = 2.0, -2.0
    return tensor


_ROTATION = _rotation_tensor()
