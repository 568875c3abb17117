"""Contacts of the robot in one tick: names of obstacles, bumper segments, wheels on the ground."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from robot_sim.arm.arm_touch import arm_parts, replay
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.drive.bumpers import Bumpers, pressed_by
from robot_sim.physics import TickMotion
from robot_sim.robot.bumper_geom import BUMPER
from robot_sim.robot.contact_sensors import ContactSensorColumns
from robot_sim.robot.mujoco_body import FLOOR_BIT, WHEELS
from robot_sim.robot.underbody import NOSE

_UPRIGHT = 0.7
"""Vertical part of a contact's normal from which on the contact presses no bumper."""
_CLEAR = Bumpers()


@dataclass(frozen=True, slots=True)
class ContactSummary:
    """The contacts of a tick; a contact in one of its steps is enough."""

    names: tuple[str, ...]
    """Sorted names of obstacles, and of kerbs that the nose ran into."""
    bumpers: Bumpers
    """Pressed segments of the bumper rings."""
    grounded: bool
    """Whether the hull touched the ground."""
    wheels_down: tuple[bool, bool, bool, bool]
    """Whether each of ``WHEELS`` was on the ground."""


class ContactFinder:
    """Finds the contacts of all steps of a tick in which the contact sensors counted any."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Look up the robot's parts; ``data`` is the state at rest before the first tick."""
        self._model = model
        self._columns = ContactSensorColumns.of(model, "base_link", WHEELS)
        self._base = int(model.body("base_link").id)
        roots = model.body_rootid[model.geom_bodyid]
        self._is_robot: list[bool] = np.asarray(roots == self._base).tolist()
        # What an arm touches is its own affair: it is there to touch things.
        self._is_arm: list[bool] = arm_parts(model)[model.geom_bodyid].tolist()
        rings = ("chassis", NOSE, BUMPER, *(f"{wheel}_hull" for wheel in WHEELS))
        # There is a bumper geom only in worlds where something moves on its own.
        ids = (mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in rings)
        self._ring = {geom for geom in ids if geom >= 0}
        self._nose = int(model.geom(NOSE).id)
        self._tyres = {int(model.geom(f"{wheel}_tyre").id) for wheel in WHEELS}
        self._scratch = mujoco.MjData(model)
        self._before: FloatArray = data.qpos.copy()

    def find(self, data: mujoco.MjData, motion: TickMotion) -> ContactSummary:
        """Return the contacts of the tick that has just been rolled out into ``data``."""
        felt = motion.sensors[:, self._columns.hull] > 0.0
        before, self._before = self._before, motion.positions[-1].copy()
        touching = np.count_nonzero(felt) > 0
        states = self._touching_states(data, motion, felt, before) if touching else ()
        return self._touches(motion.sensors, states)

    def begin(self, data: mujoco.MjData) -> ContactSummary:
        """Return the contacts before the first tick, after ``mj_forward``."""
        return self._touches(data.sensordata[None, :], [data])

    def _touches(self, sensors: FloatArray, states: Iterable[mujoco.MjData]) -> ContactSummary:
        counts = np.maximum.reduce(sensors[:, self._columns.tyres]).tolist()
        wheels_down = (counts[0] > 0.0, counts[1] > 0.0, counts[2] > 0.0, counts[3] > 0.0)
        names: set[str] = set()
        patches: list[FloatArray] = []
        grounded = False
        for state in states:
            found, met, sat = self._contacts(state)
            names |= found
            patches += met
            grounded |= sat
        bumpers = pressed_by(patches) if patches else _CLEAR
        return ContactSummary(tuple(sorted(names)), bumpers, grounded, wheels_down)

    def _touching_states(
        self, data: mujoco.MjData, motion: TickMotion, felt: BoolArray, before: FloatArray
    ) -> Iterator[mujoco.MjData]:
        """Yield a state with contacts for each set of parts that was touched in a step.

        Contacts of a step are those at its start; the last step's are still in ``data``. Each state
        is valid until the next one is yielded.
        """
        seen = set()
        if felt[-1].any():
            seen.add(felt[-1].tobytes())
            yield data
        for step, parts in enumerate(felt[:-1]):
            if parts.any() and parts.tobytes() not in seen:
                seen.add(parts.tobytes())
                positions = motion.positions[step - 1] if step else before
                replay(self._model, self._scratch, data, positions)
                yield self._scratch

    def _contacts(self, state: mujoco.MjData) -> tuple[set[str], list[FloatArray], bool]:
        """Return names touched, pressing patches in ``base_link``, and whether the hull is grounded."""
        model = self._model
        origin, rotation = state.xpos[self._base], state.xmat[self._base].reshape(3, 3)
        names: set[str] = set()
        grounded = False
        patches: dict[tuple[int, int], list[FloatArray]] = {}
        up = rotation[:, 2]
        contacts = state.contact
        # MuJoCo creates such an array at each access.
        positions, frames = contacts.pos, contacts.frame
        for number, (first, second) in enumerate(contacts.geom.tolist()):
            if first in self._tyres or second in self._tyres:
                continue
            if self._is_robot[first] == self._is_robot[second]:
                continue
            part, other = (first, second) if self._is_robot[first] else (second, first)
            if self._is_arm[part]:
                continue
            at, axes = positions[number], frames[number]
            flat = abs(float(up @ axes[:3])) < _UPRIGHT
            # The nose can meet the face of a kerb; any other contact with ground means grounding.
            face = part == self._nose and flat and abs(float(axes[2])) < _UPRIGHT
            if model.geom_contype[other] == FLOOR_BIT and not face:
                grounded = True
                continue
            names.add(self._name(other))
            if flat and part in self._ring:
                patches.setdefault((part, other), []).append((at - origin) @ rotation)
        return names, [np.array(points) for points in patches.values()], grounded

    def _name(self, geom: int) -> str:
        name: str = self._model.geom(geom).name
        return name or self._model.body(int(self._model.geom_bodyid[geom])).name or f"geom {geom}"
