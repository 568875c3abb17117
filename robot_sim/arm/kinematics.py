"""Forward kinematics of an arm: its frames, its tip and the Jacobian, from the Denavit-Hartenberg rows.

Plain numbers instead of small arrays: for five joints they are several times as fast, and a planner asks often.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from robot_sim.arm.arm_table import ArmTable
from robot_sim.array_types import FloatArray

JointAngles = FloatArray | Sequence[float]
"""An angle of each joint [rad], without the offsets theta of the table."""

_Frame = tuple[float, float, float, float, float, float, float, float, float, float, float, float]
"""Axes x, y and z of a frame and its origin, in ``arm_base``."""


class Kinematics:
    """Where the frames of an arm are; ``ArmTable`` describes them."""

    def __init__(self, table: ArmTable) -> None:
        """Prepare what does not change with the angles."""
        self.table = table
        self._rows = tuple((j.theta, j.d, j.a, *_turn(j.alpha)) for j in table.joints)
        height = table.links[0].length
        self._first: _Frame = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, height)

    def frames(self, angles: JointAngles) -> FloatArray:
        """Return ``arm_base_from_frame`` (7, 4, 4) of frames 0 to 5 and of ``tool0``."""
        frames = (self._first, *self._walk(angles))
        return np.array([_matrix(frame) for frame in (*frames, _tool(frames[-1]))])

    def tip(self, angles: JointAngles) -> FloatArray:
        """Return ``arm_base_from_tool0`` (4, 4)."""
        *_, last = self._walk(angles)
        return np.array(_matrix(_tool(last)))

    def tip_and_jacobian(self, angles: JointAngles) -> tuple[FloatArray, FloatArray]:
        """Return ``arm_base_from_tool0`` (4, 4) and the Jacobian (6, 5) of its origin.

        The Jacobian's first three rows are the linear velocity [m/s] for each joint's rate, the others the angular
        velocity [rad/s], all along the axes of ``arm_base``: z x (tip - origin) above z, both of the frame before the
        joint.
        """
        frames = (self._first, *self._walk(angles))
        tip = frames[-1]
        tx, ty, tz = tip[9:]
        linear_x, linear_y, linear_z = [], [], []
        for _, _, _, _, _, _, zx, zy, zz, px, py, pz in frames[:-1]:
            rx, ry, rz = tx - px, ty - py, tz - pz
            linear_x.append(zy * rz - zz * ry)
            linear_y.append(zz * rx - zx * rz)
            linear_z.append(zx * ry - zy * rx)
        angular = ([frame[k] for frame in frames[:-1]] for k in (6, 7, 8))
        jacobian = np.array([linear_x, linear_y, linear_z, *angular])
        return np.array(_matrix(_tool(tip))), jacobian

    def _walk(self, angles: JointAngles) -> Iterator[_Frame]:
        """Yield frames 1 to 5: turn by theta about z, go d along z and a along x, turn by alpha about x."""
        xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz = self._first
        numbers = angles.tolist() if isinstance(angles, np.ndarray) else angles
        for angle, (theta, d, a, cos_alpha, sin_alpha) in zip(numbers, self._rows, strict=True):
            cos, sin = math.cos(angle + theta), math.sin(angle + theta)
            # u is the axis y after the turn by theta; below, alpha turns it and z about the new x.
            ux, uy, uz = cos * yx - sin * xx, cos * yy - sin * xy, cos * yz - sin * xz
            xx, xy, xz = cos * xx + sin * yx, cos * xy + sin * yy, cos * xz + sin * yz
            px, py, pz = px + d * zx + a * xx, py + d * zy + a * xy, pz + d * zz + a * xz
            yx, zx = cos_alpha * ux + sin_alpha * zx, cos_alpha * zx - sin_alpha * ux
            yy, zy = cos_alpha * uy + sin_alpha * zy, cos_alpha * zy - sin_alpha * uy
            yz, zz = cos_alpha * uz + sin_alpha * zz, cos_alpha * zz - sin_alpha * uz
            yield xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz


def _turn(angle: float) -> tuple[float, float]:
    """Return cosine and sine, exact for right angles."""
    cos, sin = math.cos(angle), math.sin(angle)
    return (0.0 if abs(cos) < 1e-15 else cos), (0.0 if abs(sin) < 1e-15 else sin)


def _tool(frame: _Frame) -> _Frame:
    """Turn frame 5 by -90 degrees about x: in ROS a tool has z up."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz = frame
    return xx, xy, xz, -zx, -zy, -zz, yx, yy, yz, px, py, pz


def _matrix(frame: _Frame) -> list[list[float]]:
    xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz = frame
    return [[xx, yx, zx, px], [xy, yy, zy, py], [xz, yz, zz, pz], [0.0, 0.0, 0.0, 1.0]]
