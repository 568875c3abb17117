"""Distance of an arm to the world, the vehicle, and itself, in poses that it might take."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from robot_sim.arm.arm_table import JOINTS, ArmTable
from robot_sim.arm.clearance_model import ClearanceModel
from robot_sim.arm.kinematics import JointAngles
from robot_sim.arm.levers import levers
from robot_sim.arm.obstacles import Box, Obstacles, of_boxes
from robot_sim.arm.surroundings import Surroundings
from robot_sim.array_types import FloatArray

MARGIN: Final = 0.002
"""Distance that the arm keeps to everything [m]."""
HORIZON: Final = 0.1
"""Distance beyond which nothing counts as near [m]."""
_SLOTS: Final = 12
"""Obstacles that the model has room for at first; it is compiled anew for more."""
_CELL: Final = math.radians(1.0)
"""Half the smallest cell in which the poses of the upper arm are searched."""
_NEXT, _AFTER = np.array([1, 2, 0]), np.array([2, 0, 1])
_STILL: Final = 1e-5
"""Motion of obstacles that is not followed [m, rad]."""
_SLIP: Final = 2e-4
"""Slip of what is held that is not followed [m, rad]."""
_IN_HAND: Final = 0.1
"""How far what is held may reach beyond the tip [m]."""
_NOTHING: Final = of_boxes(())

Pair = tuple[str, str]
"""Names of a part of the arm and of what it is near to."""


@dataclass(frozen=True, slots=True, eq=False)
class Near:
    """Two shapes that are near to each other, one of them the arm's."""

    distance: float
    """Between them [m]; negative inside."""
    gradient: FloatArray
    """(5,) of the distance by the joints' angles [m/rad]."""
    names: Pair
    """The arm's part and the other."""


class Clearance:
    """Answers how near an arm is to anything; owns what was near when it last looked.

    Bodies that can be picked up may be touched by palm and jaws, and by nothing else. What is held is part of the arm.
    """

    def __init__(self, table: ArmTable, mount: str = "bracket") -> None:
        """Take an arm with nothing around it, not even the vehicle.

        Raises:
            ArmError: If there is no such mount; the message lists those there are.
        """
        self.table, self._mount = table, mount
        self.checks = 0
        """Number of poses that have been checked: the unit of budgets."""
        self.changes = 0
        """Number of times that something near, or what is held, was found elsewhere than before."""
        self.levers = levers(table)
        """Greatest distance (5,) of a point of the arm from each joint's axis [m]; grows with what is held."""
        self._around: Surroundings | None = None
        self._vehicle = self._given = self._placed = self._in_hand = _NOTHING
        self._in_upper_reach = np.zeros(0, dtype=bool)
        self._compile(_SLOTS)
        base = table.mounts[mount]
        height = table.links[0].length + table.joints[0].d
        self._shoulder = base.position + height * base.rotation[:, 2]

    def surround(self, boxes: Sequence[Box]) -> None:
        """Take boxes as obstacles, beside what ``follow`` finds from then on."""
        self._given = of_boxes(boxes)
        self._place(self._given)

    def follow(self, model: mujoco.MjModel, data: mujoco.MjData, held: str = "") -> None:
        """Look at a simulation: at what is near the arm, at the jaws, and at what they hold.

        Args:
            model: The simulation's model, with the vehicle, and with or without the arm.
            data: Its state.
            held: Name of the body that the gripper holds; empty without one.
        """
        if self._around is None or self._around.model is not model:
            self._meet(model, data)
        around = self._around
        assert around is not None
        near = around.near(data, self._shoulder, held)
        if len(self._given):
            near += self._given
        if not near.stands_like(self._placed, _STILL):
            self._place(near)
        if (jaws := around.jaws(data)) is not None:
            self._small.jaws[:] = jaws
        in_hand = around.held(data, held) if held else _NOTHING
        if not in_hand.stands_like(self._in_hand, _SLIP):
            self._hold(in_hand)

    def hold(self, box: Box | None) -> None:
        """Let the gripper hold a box, whose pose is in ``tool0``, or nothing."""
        self._hold(_NOTHING if box is None else of_boxes((box,)))

    def free(
        self,
        angles: JointAngles,
        allowed: Mapping[Pair, float] | None = None,
        margin: float = MARGIN,
    ) -> bool:
        """Return whether all pairs are apart by a margin [m].

        Args:
            angles: Pose (5,) [rad].
            allowed: Pairs that may be as near as this [m], from ``touching`` where the arm stands: what is too near can
                always be left.
            margin: The margin.
        """
        if not self._contacts(angles, margin):
            return True
        if not allowed:
            return False
        found = self._pairs(margin)
        return all(distance >= allowed.get(pair, margin) for pair, distance in found.items())

    def touching(self, angles: JointAngles, margin: float = MARGIN) -> dict[Pair, float]:
        """Return the pairs nearer than a margin [m], with their distances [m]."""
        return self._pairs(margin) if self._contacts(angles, margin) else {}

    def distance(self, angles: JointAngles, horizon: float = HORIZON) -> float:
        """Return the smallest distance [m]; ``horizon`` if that is greater. A small horizon costs less."""
        if not self._contacts(angles, horizon):
            return horizon
        return min(float(self._data.contact.dist.min()), horizon)

    def near(self, angles: JointAngles, within: float = 0.03) -> tuple[Near, ...]:
        """Return what is nearer than ``within`` [m], nearest first; of some pairs of shapes two or more points."""
        if not self._contacts(angles, within):
            return ()
        contact, data = self._data.contact, self._data
        distances, normals, geoms = contact.dist, contact.frame[:, :3], contact.geom
        # A joint moves the witness point p at axis x (p - anchor), of which the normal's share counts; both witness
        # points are on one normal, from the first geom to the second, and have one moment about each axis.
        axes, anchors = data.xaxis[:JOINTS], data.xanchor[:JOINTS]
        ways = _cross(contact.pos, normals) @ axes.T - normals @ _cross(axes, anchors).T
        moved = self._small.moved_by[geoms]
        gradients = (moved[:, 1] - moved[:, 0]) * ways
        names = self._named(geoms.tolist())
        rows = distances.tolist()
        order = sorted(range(len(rows)), key=rows.__getitem__)
        return tuple(Near(rows[k], gradients[k], names[k]) for k in order)

    def nearest(self, angles: JointAngles, within: float = HORIZON) -> Near | None:
        """Return what is nearest, if anything is within this distance [m]."""
        return next(iter(self.near(angles, within)), None)

    def _contacts(self, angles: JointAngles, margin: float) -> int:
        """Find the pairs within a margin [m]; return the number of their points."""
        model, data = self._mujoco, self._data
        self._angles[:] = angles
        self._option.o_margin = margin
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        self.checks += 1
        return int(data.ncon)

    def _pairs(self, margin: float) -> dict[Pair, float]:
        """Return the smallest distance of each pair just found."""
        contact, found = self._data.contact, dict[Pair, float]()
        for pair, distance in zip(
            self._named(contact.geom.tolist()), contact.dist.tolist(), strict=True
        ):
            found[pair] = min(distance, found.get(pair, margin))
        return found

    def _named(self, geoms: Sequence[Sequence[int]]) -> list[Pair]:
        """Return the names of pairs of geoms, the part that more joints move first."""
        names, depth = self._small.names, self._small.depth
        return [
            (names[a], names[b]) if depth[a] >= depth[b] else (names[b], names[a]) for a, b in geoms
        ]

    def _meet(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Look at a simulation for the first time."""
        reach = float(self.levers[0]) + _IN_HAND + HORIZON
        self._around = Surroundings(model, data, reach)
        vehicle = self._around.vehicle
        self._vehicle = vehicle[vehicle.distances(self._shoulder) <= reach]
        self._placed, self._in_upper_reach = _NOTHING, np.ones(len(self._vehicle), dtype=bool)
        self._compile(self._slots)
        hit = self._hit_by_upper_arm()
        self._in_upper_reach = np.array([name in hit for name in self._vehicle.names])
        self._small.mount(self._vehicle, self._in_upper_reach)

    def _hit_by_upper_arm(self) -> set[str]:
        """Return the parts of the vehicle that the upper arm can hit; the others would always be what is nearest.

        Two joints move it, so that all its poses can be searched: within a cell it moves no further than its length
        along the arcs of both.
        """
        upright, upper = self.table.joints[:2]
        length = math.hypot(upper.a, upper.d) + max(upper.servo.size)
        name, hit = self.table.links[2].name, set[str]()
        angles = np.array(self.table.poses["stow"])
        half = 0.5 * max(j.upper - j.lower for j in (upright, upper))
        cells = [(0.5 * (upright.lower + upright.upper), 0.5 * (upper.lower + upper.upper), half)]
        while cells:
            first, second, half = cells.pop()
            angles[:2] = first, second
            near = MARGIN + 2.0 * half * length
            self._contacts(angles, near)
            parts = {b: d for (a, b), d in self._pairs(near).items() if a == name and b not in hit}
            hit |= {part for part, distance in parts.items() if distance < MARGIN or half < _CELL}
            if parts.keys() - hit:
                half *= 0.5
                cells += [
                    (first + x * half, second + y * half, half) for x in (-1, 1) for y in (-1, 1)
                ]
        return hit

    def _place(self, obstacles: Obstacles) -> None:
        self.changes += 1
        self._placed = obstacles
        if len(obstacles) > self._slots:
            self._compile(2 * len(obstacles))
        else:
            self._small.place(obstacles)

    def _hold(self, geoms: Obstacles) -> None:
        self.changes += 1
        self._in_hand = geoms
        self._small.hold(geoms)
        self.levers = levers(self.table, self._small.held_reach)

    def _compile(self, slots: int) -> None:
        """Compile the model with room for so many obstacles, and put everything back into it."""
        self._slots = slots
        world = None if self._around is None else self._around.model
        slots += len(self._vehicle)
        small = self._small = ClearanceModel(self.table, self._mount, slots=slots, world=world)
        self._mujoco, self._data, self._angles = small.model, small.data, small.angles
        self._option = small.model.opt
        small.mount(self._vehicle, self._in_upper_reach)
        small.place(self._placed)
        small.hold(self._in_hand)


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the vector products (N, 3); of so few NumPy's own takes five times as long."""
    a, b = first, second
    product: FloatArray = a[:, _NEXT] * b[:, _AFTER] - a[:, _AFTER] * b[:, _NEXT]
    return product
