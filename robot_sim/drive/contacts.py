"""What the robot touches in one tick, by name and by segment of its bumpers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.drive.bumpers import Bumpers, pressed_by
from robot_sim.physics import TickMotion
from robot_sim.robot.bumper_geom import BUMPER
from robot_sim.robot.contact_sensors import ContactSensorColumns
from robot_sim.robot.mujoco_body import FLOOR_BIT, WHEELS
from robot_sim.robot.underbody import NOSE

_UPRIGHT = 0.7
"""A contact whose normal is as vertical as this presses no bumper."""
_CLEAR = Bumpers()


@dataclass(frozen=True, slots=True)
class ContactSummary:
    """What a tick's contacts amount to; one step of the tick is enough."""

    names: tuple[str, ...]
    """Of the obstacles, and of kerbs that the nose ran into; sorted."""
    bumpers: Bumpers
    grounded: bool
    """Whether the hull sat on the ground."""
    wheels_down: tuple[bool, bool, bool, bool]
    """Whether each of ``WHEELS`` was on the ground."""


class ContactFinder:
    """Finds the contacts of every step of a tick in which the feelers felt something."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Look up the robot's parts; ``data`` is at rest where the first tick begins."""
        self._model = model
        self._columns = ContactSensorColumns.of(model, "base_link", WHEELS)
        self._base = int(model.body("base_link").id)
        roots = model.body_rootid[model.geom_bodyid]
        self._is_robot: list[bool] = np.asarray(roots == self._base).tolist()
        rings = ("chassis", NOSE, BUMPER, *(f"{wheel}_hull" for wheel in WHEELS))
        # Only where something moves on its own is there a fender.
        ids = (mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in rings)
        self._ring = {geom for geom in ids if geom >= 0}
        self._nose = int(model.geom(NOSE).id)
        self._tyres = {int(model.geom(f"{wheel}_tyre").id) for wheel in WHEELS}
        self._scratch = mujoco.MjData(model)
        self._before: FloatArray = data.qpos.copy()

    def find(self, data: mujoco.MjData, motion: TickMotion) -> ContactSummary:
        """Return what was touched in the tick that has just been rolled out into ``data``."""
        felt = motion.sensors[:, self._columns.hull] > 0.0
        before, self._before = self._before, motion.positions[-1].copy()
        touching = np.count_nonzero(felt) > 0
        states = self._touching_states(data, motion, felt, before) if touching else ()
        return self._touches(motion.sensors, states)

    def begin(self, data: mujoco.MjData) -> ContactSummary:
        """Return what is touched before the first tick, after ``mj_forward``."""
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
        """Yield states with the contacts of the steps in which other parts were touched than in the last.

        Contacts of a step are those of its start; the last step's are still in ``data``. Each state
        holds until the next is asked for.
        """
        seen = set()
        if felt[-1].any():
            seen.add(felt[-1].tobytes())
            yield data
        for step, parts in enumerate(felt[:-1]):
            if parts.any() and parts.tobytes() not in seen:
                seen.add(parts.tobytes())
                yield self._replayed(data, motion.positions[step - 1] if step else before)

    def _replayed(self, data: mujoco.MjData, positions: FloatArray) -> mujoco.MjData:
        """Find the contacts of a step again."""
        state = self._scratch
        state.qpos[:] = positions
        state.mocap_pos[:], state.mocap_quat[:] = data.mocap_pos, data.mocap_quat
        mujoco.mj_kinematics(self._model, state)
        mujoco.mj_collision(self._model, state)
        return state

    def _contacts(self, state: mujoco.MjData) -> tuple[set[str], list[FloatArray], bool]:
        """Return names touched, patches in ``base_link`` that press, and whether the hull sat down."""
        model = self._model
        origin, rotation = state.xpos[self._base], state.xmat[self._base].reshape(3, 3)
        names: set[str] = set()
        grounded = False
        patches: dict[tuple[int, int], list[FloatArray]] = {}
        up = rotation[:, 2]
        contacts = state.contact
        # MuJoCo makes such an array anew whenever it is asked for it.
        positions, frames = contacts.pos, contacts.frame
        for number, (first, second) in enumerate(contacts.geom.tolist()):
            if first in self._tyres or second in self._tyres:
                continue
            if self._is_robot[first] == self._is_robot[second]:
                continue
            part, other = (first, second) if self._is_robot[first] else (second, first)
            at, axes = positions[number], frames[number]
            flat = abs(float(up @ axes[:3])) < _UPRIGHT
            # A kerb's face is met by the nose; all other ground is sat upon.
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
