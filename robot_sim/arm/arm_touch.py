"""What an arm touches: names, what its gripper holds and how firmly, and whether a part touches what it should not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from robot_sim.arm.parts import ARM_BASE, JAWS
from robot_sim.array_types import BoolArray, FloatArray

CONTACTS: Final = "arm_touch"
"""Name of the sensor that counts the contacts of the arm in each step."""
PICKABLE: Final = 0.2
"""Mass up to which a free body counts as something to pick up [kg]: four times what the arm can lift at its shortest."""


@dataclass(frozen=True, slots=True)
class Touches:
    """What an arm touches in one step."""

    names: tuple[str, ...] = ()
    """Sorted names of the geoms, or of what can be picked up the bodies."""
    held: str = ""
    """Name of the body that both pads touch; empty without one."""
    force: float = 0.0
    """Force with which the pads press on what is between them, of both together [N]."""
    hit: bool = False
    """Whether a part of the arm touches anything but the gripper something to pick up."""

    def with_passed(self, other: Touches) -> Touches:
        """Return these, and the names of others that were before."""
        names = tuple(sorted({*self.names, *other.names}))
        return Touches(names, self.held, self.force, self.hit or other.hit)


NOTHING: Final = Touches()


def add_contact_counter(spec: mujoco.MjSpec) -> None:
    """Add a sensor that counts the contacts of the arm and all that is beyond it."""
    sensor = spec.add_sensor(
        name=CONTACTS,
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=mujoco.mjtObj.mjOBJ_XBODY,
        objname=ARM_BASE,
    )
    # The number of contacts, of which none is kept but the deepest.
    sensor.intprm[:3] = (1 << int(mujoco.mjtConDataField.mjCONDATA_FOUND), 1, 1)


def arm_parts(model: mujoco.MjModel) -> BoolArray:
    """Return which bodies (B,) belong to the arm; none in a model without one."""
    belongs = np.zeros(model.nbody, dtype=bool)
    base = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, ARM_BASE)
    if base < 0:
        return belongs
    belongs[base] = True
    for body in range(base + 1, model.nbody):
        belongs[body] |= belongs[model.body_parentid[body]]
    return belongs


def pickable_bodies(model: mujoco.MjModel) -> BoolArray:
    """Return which bodies (B,) can be picked up: free, of one piece and light."""
    free = np.zeros(model.nbody, dtype=bool)
    free[model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]] = True
    light: BoolArray = model.body_subtreemass <= PICKABLE
    single: BoolArray = model.body_subtreemass == model.body_mass
    return free & light & single


def bodies_in_hand(model: mujoco.MjModel, data: mujoco.MjData) -> list[int]:
    """Return the bodies that can be picked up and that the arm touches now."""
    if model.nnumeric == 0:
        return []
    bodies = model.geom_bodyid[np.asarray(data.contact.geom).reshape(-1, 2)]
    touched = bodies[arm_parts(model)[bodies].any(axis=1)].ravel()
    return sorted({int(body) for body in touched[pickable_bodies(model)[touched]]})


def replay(
    model: mujoco.MjModel, scratch: mujoco.MjData, data: mujoco.MjData, positions: FloatArray
) -> None:
    """Compute the contacts of a past step again, with its positions (nq,) and the mocap bodies of ``data``."""
    scratch.qpos[:] = positions
    scratch.mocap_pos[:], scratch.mocap_quat[:] = data.mocap_pos, data.mocap_quat
    mujoco.mj_kinematics(model, scratch)
    mujoco.mj_collision(model, scratch)


class TouchFinder:
    """Finds what an arm touches, from the contacts of a state."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Look up the arm of a model, and what can be picked up."""
        self._model = model
        bodies = model.geom_bodyid
        self._is_arm: list[bool] = arm_parts(model)[bodies].tolist()
        self._pickable: list[bool] = pickable_bodies(model)[bodies].tolist()
        gripper = [model.body(name).id for name in JAWS]
        self._jaw_of = {
            g: i for i, jaw in enumerate(gripper) for g in np.flatnonzero(bodies == jaw)
        }
        names = [model.geom(g).name for g in range(model.ngeom)]
        self._gripper = {g for g, name in enumerate(names) if "_palm" in name} | set(self._jaw_of)
        self._jaws = gripper
        self._force = np.zeros(6)

    def find(self, data: mujoco.MjData) -> Touches:
        """Return what the arm touches in the step that ``data`` has just made."""
        names: set[str] = set()
        pressed: tuple[set[int], set[int]] = (set(), set())
        force, hit = 0.0, False
        geoms = data.contact.geom.tolist()
        for number, (first, second) in enumerate(geoms):
            if not (self._is_arm[first] or self._is_arm[second]):
                continue
            part, other = (first, second) if self._is_arm[first] else (second, first)
            names.add(self._name(other))
            if not (part in self._gripper and self._pickable[other]):
                hit = True
                continue
            jaw = self._jaw_of.get(part)
            if jaw is not None:
                pressed[jaw].add(int(self._model.geom_bodyid[other]))
                force += self._pressing(data, number, self._jaws[jaw])
        both = pressed[0] & pressed[1]
        held = self._model.body(min(both)).name if both else ""
        return Touches(tuple(sorted(names)), held, force, hit)

    def _pressing(self, data: mujoco.MjData, contact: int, jaw: int) -> float:
        """Return the force of a contact along the way of a jaw [N]."""
        mujoco.mj_contactForce(self._model, data, contact, self._force)
        across: FloatArray = data.xmat[jaw].reshape(3, 3)[:, 1]
        frame = data.contact[contact].frame.reshape(3, 3)
        return abs(float(self._force[:3] @ frame @ across))

    def _name(self, geom: int) -> str:
        model = self._model
        body: str = model.body(int(model.geom_bodyid[geom])).name
        return body if self._pickable[geom] else model.geom(geom).name or body
