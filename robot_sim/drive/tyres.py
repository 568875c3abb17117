"""Tyres: friction and rolling resistance of each wheel by ground and slip.

With MuJoCo's Coulomb contacts the yaw-rate ratio chi is one number for every curve. That of a real
P3-AT falls as the radius grows (Wang et al., Sensors 2015, 15, 9681): a pneumatic tyre that barely
slips bends sideways before it slides, so that its grip across the wheel is lower than along it.
``lateral_grip`` is that ratio; its form and its two constants are fitted to the published curve, not
derived.

MuJoCo aligns a capsule's contact frame with the wheel on planes only. On boxes, heightfields and
meshes its axes are fixed in the world, so that grip is the same in all directions there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.drive.wheel_slip import contact_positions
from robot_sim.errors import WorldError
from robot_sim.robot.mujoco_body import SIDES, WHEELS
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.scene_objects.floor_surfaces import Patch, patches_under

FULL_SLIDE: Final = 0.56
"""Slip over rim speed from which on the whole contact slides: that of a P3-AT turning in place."""
FALL: Final = 0.065
"""Rate at which the lateral grip falls below that; fitted to chi at lambda 1 to 50."""
LEAST_SLIP: Final = 0.008
"""Slip over rim speed below which the published curve (lambda < 60) has no data; grip is constant
there."""
REST: Final = 1e-4
"""Slip that counts as sliding [m/s]: a robot at rest has full grip."""

GRAVITY: Final = 9.81
"""Acceleration of gravity in the models [m/s^2]."""


def lateral_grip(slip: float, rim: float) -> float:
    """Return the share of its lateral friction that a tyre has: 1 when sliding, less when rolling.

    Args:
        slip: Speed of the contact over the ground [m/s], >= 0.
        rim: Rim speed of the wheel [m/s].
    """
    share = math.hypot((slip + REST) / max(abs(rim), 1e-9), LEAST_SLIP)
    if share >= FULL_SLIDE:
        return 1.0
    return 1.0 / math.sqrt(1.0 + FALL * (math.sqrt(FULL_SLIDE / share) - 1.0))


class Tyres:
    """Writes the wheels' friction into a simulation's own model, once per tick.

    The values depend on positions and velocities alone; the patches under the wheels are remembered
    only to write what changes.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        robot: SkidSteer,
        patches: Sequence[Patch] = (),
        *,
        compliant: bool = True,
    ) -> None:
        """Look up the wheels' contact pairs.

        Args:
            model: Model with the robot in it; it is modified, so it must not be shared.
            robot: Parameters of the robot in the model.
            patches: Areas of other surfaces on the ground; later ones cover earlier ones.
            compliant: Whether the tyres bend sideways; otherwise friction is Coulomb's.

        Raises:
            WorldError: a wheel has no contact pair.
        """
        self._model = model
        self._patches = tuple(patches)
        self._compliant = compliant
        base = model.joint("base_link")
        self._q, self._v = int(base.qposadr[0]), int(base.dofadr[0])
        wheels = [int(model.joint(w).dofadr[0]) for w in WHEELS]
        self._wheels = np.array(wheels)
        self._radii = np.array([robot.true_rolling_radius(s) for s in SIDES])
        self._x, self._y = contact_positions(robot)
        self._contacts = tuple(
            zip(wheels, self._x.tolist(), self._y.tolist(), self._radii.tolist(), strict=True)
        )
        self._points = np.stack([self._x, self._y, np.zeros(4)], axis=1)
        found = [_pairs_of(model, w) for w in WHEELS]
        self._pairs = np.array([pairs for pairs, _ in found])
        self._friction: FloatArray = model.pair_friction[self._pairs][..., :2].copy()
        grounds = np.array([g for _, g in found])
        self._oriented: FloatArray = 1.0 * (model.geom_type[grounds] == mujoco.mjtGeom.mjGEOM_PLANE)
        self._stiction = robot.imperfections.stiction
        load = model.body_subtreemass[model.body("base_link").id] * GRAVITY / len(WHEELS)
        self._resisted = load * self._radii
        self._resistances = _rolling_resistances(model)
        here = {float(self._resistances[g]) for _, gs in found for g in gs}
        self._rolling = np.full(len(WHEELS), min(here))
        self._mixed = len(here) > 1
        self._tyres = np.array([model.geom(f"{w}_tyre").id for w in WHEELS])
        self._under: tuple[Patch | None, ...] = (None,) * len(WHEELS)
        # (4, P) friction of the wheels' pairs across them, where they stand.
        self._across: FloatArray = self._friction[..., 0].copy()
        # Each access to a field of a MuJoCo model creates a view; this one is kept.
        self._pair_friction = model.pair_friction[:, 0]
        self._resist(self._rolling)

    def grip(self, data: mujoco.MjData) -> None:
        """Set the friction of every wheel for the coming tick."""
        if self._patches or self._mixed:
            self._roll_onto(data)
        across = self._across
        if self._compliant:
            # For capsules on planes the first tangent of a contact is across the wheel.
            across = across * (1.0 - self._oriented * (1.0 - self._lateral(data)))
        self._pair_friction[self._pairs] = across

    def _resist(self, rolling: FloatArray) -> None:
        """Set the dry friction of the wheels' joints for (4,) rolling resistances."""
        self._model.dof_frictionloss[self._wheels] = self._stiction + rolling * self._resisted

    def _lateral(self, data: mujoco.MjData) -> FloatArray:
        """Return the (4, 1) share of its lateral friction that each wheel has."""
        q, v, rates = self._q, self._v, data.qvel.tolist()
        forward, left, turn = _planar(data.qpos[q + 3 : q + 7].tolist(), rates[v : v + 6])
        grips = []
        # For four wheels plain numbers are four times faster than NumPy.
        for wheel, x, y, radius in self._contacts:
            rim = radius * rates[wheel]
            slip = math.hypot(forward - turn * y - rim, left + turn * x)
            grips.append((lateral_grip(slip, rim),))
        return np.array(grips)

    def _roll_onto(self, data: mujoco.MjData) -> None:
        """Set friction along the wheels and rolling resistance from the ground under them."""
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, data.qpos[self._q + 3 : self._q + 7])
        contacts = self._points @ rotation.reshape(3, 3).T
        under = patches_under(self._patches, contacts + data.qpos[self._q : self._q + 3])
        if under == self._under and not self._mixed:
            return
        self._under = under
        friction, rolling = self._friction.copy(), self._rolling.copy()
        if self._mixed:
            rolling = self._resistance_touched(data)
        for wheel, patch in enumerate(under):
            if patch is None:
                continue
            surface = patch.surface
            even = 0.5 * (surface.mu_lat + surface.mu_long)
            aligned = self._oriented[wheel] > 0.0
            friction[wheel, :, 0] = np.where(aligned, surface.mu_lat, even)
            friction[wheel, :, 1] = np.where(aligned, surface.mu_long, even)
            rolling[wheel] = surface.rolling_resistance
        self._across = friction[..., 0].copy()
        self._model.pair_friction[self._pairs, 1] = friction[..., 1]
        self._resist(rolling)

    def _resistance_touched(self, data: mujoco.MjData) -> FloatArray:
        """Return the largest rolling resistance (4,) that each tyre touches; 0 in the air."""
        touching = np.asarray(data.contact.geom).reshape(-1, 2)
        wheel, contact, side = np.nonzero(touching == self._tyres[:, None, None])
        rolling = np.zeros(len(WHEELS))
        np.maximum.at(rolling, wheel, self._resistances[touching[contact, 1 - side]])
        return rolling


def _planar(quaternion: Sequence[float], velocity: Sequence[float]) -> tuple[float, float, float]:
    """Return forward and leftward speed and yaw rate in ``base_link`` of a free joint's velocity."""
    w, x, y, z = quaternion
    vx, vy, vz, _, _, turn = velocity
    forward = (1 - 2 * (y * y + z * z)) * vx + 2 * (x * y + w * z) * vy + 2 * (x * z - w * y) * vz
    left = 2 * (x * y - w * z) * vx + (1 - 2 * (x * x + z * z)) * vy + 2 * (y * z + w * x) * vz
    return forward, left, turn


def _pairs_of(model: mujoco.MjModel, wheel: str) -> tuple[list[int], list[int]]:
    """Return the contact pairs of a wheel and the other geom of each."""
    tyre = model.geom(f"{wheel}_tyre").id
    both = np.stack([model.pair_geom1, model.pair_geom2], axis=1)
    # The order of the geoms in a pair is not fixed.
    pairs = np.flatnonzero((both == tyre).any(axis=1))
    if not len(pairs):
        raise WorldError(
            f"no surface is drivable for {wheel}: the model has no contact pair for it"
        )
    return pairs.tolist(), np.where(both[pairs, 0] == tyre, both[pairs, 1], both[pairs, 0]).tolist()


def _rolling_resistances(model: mujoco.MjModel) -> FloatArray:
    """Return the (ngeom,) rolling resistance that each geom declares, 0 by default.

    It is the third value of a drivable geom's ``user`` attribute.
    """
    if model.nuser_geom < 3:
        return np.zeros(model.ngeom)
    declared: FloatArray = model.geom_user[:, 2].copy()
    return declared
