"""A small MuJoCo model of an arm and what is near it, for distances alone: in the vehicle's frame, without dynamics.

What is near sits in slots, each a body that stands still with one geom, whose kind, size and place are written as the
vehicle or the world moves. Only the arm's joints are moved from check to check.

MuJoCo's distances within a margin are exact for all pairs of shapes but two boxes, of which it misses one in six within
0.1 m, and but contacts of several points, which can be 20 mm off. So each box of the arm is a mesh of eight corners, and
pairs of convex shapes give one point. But for these the shapes are those of the physics.
"""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from localization.types import IntArray, Pose
from robot_sim.arm.arm_table import JOINTS, ArmTable
from robot_sim.arm.obstacles import Obstacles
from robot_sim.arm.parts import ARM_BASE, JAWS, TOOL, ArmBody, Solid, arm_bodies
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.errors import ArmError

_CORNERS: Final = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
_HELD: Final = 4
"""Geoms of what the gripper holds."""
_BOX, _MESH = int(mujoco.mjtGeom.mjGEOM_BOX), int(mujoco.mjtGeom.mjGEOM_MESH)
_HFIELD: Final = int(mujoco.mjtGeom.mjGEOM_HFIELD)

# What a geom is, and what it must keep away from.
_LOWER, _WORLD, _PICKABLE = 1, 2, 4
_VEHICLE, _REMOTE = 8, 16
"""Of the vehicle what the upper arm can hit, and what it cannot."""


class ClearanceModel:
    """Owns the model and its state; ``Clearance`` asks it."""

    def __init__(
        self,
        table: ArmTable,
        mount: str,
        *,
        slots: int,
        world: mujoco.MjModel | None = None,
    ) -> None:
        """Compile the arm.

        Args:
            table: The arm.
            mount: Where it is mounted, a key of the table's ``mounts``.
            slots: Number of obstacles that there is room for.
            world: Model whose meshes and height fields can be obstacles.

        Raises:
            ArmError: If there is no such mount; the message lists those there are.
        """
        place = table.mount(mount)
        spec = mujoco.MjSpec()
        self._meshes, self._fields = _add_assets(spec, world)
        tool = _add_arm(spec, table, place)
        for number in range(slots):
            _add_slot(spec, spec.worldbody, f"slot_{number}")
        for number in range(_HELD):
            spec.add_mesh(name=f"held_{number}", uservert=_CORNERS.ravel())
            _add_slot(spec, tool, f"held_{number}")
        spec.memory = 1 << 22
        # One margin for all pairs, which each question sets.
        spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_OVERRIDE
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_MULTICCD
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.angles: FloatArray = self.data.qpos[:JOINTS]
        self.jaws: FloatArray = self.data.qpos[JOINTS : JOINTS + len(JAWS)]
        self._slot = self._numbers("slot_", slots)
        self._held = self._numbers("held_", _HELD)
        self.names = [self.model.body(b).name if b else "" for b in self.model.geom_bodyid.tolist()]
        """What each geom is called: of the arm the body, in a slot the obstacle."""
        ancestry = np.zeros((self.model.nbody, JOINTS), dtype=bool)
        for body in range(1, self.model.nbody):
            ancestry[body] = ancestry[self.model.body_parentid[body]]
            joint = int(self.model.body_jntadr[body])
            if 0 <= joint < JOINTS:
                ancestry[body, joint] = True
        self.moved_by = ancestry[self.model.geom_bodyid].astype(float)
        """(G, 5) 1 where a joint moves a geom."""
        self.depth: list[float] = self.moved_by.sum(axis=1).tolist()
        """Number of joints that move each geom."""
        self._vehicle = 0
        self.held_reach = 0.0
        """Greatest distance of a point of what is held from the origin of the last joint [m]."""

    def mount(self, vehicle: Obstacles, hit: BoolArray) -> None:
        """Put the vehicle's parts, in ``base_link``, into the first slots; ``hit`` (V,) is whether the upper arm can hit each."""
        self._vehicle = len(vehicle)
        bits = np.where(hit, _VEHICLE, _REMOTE)
        self._fill(self._slot, vehicle, bits, np.zeros_like(bits))

    def place(self, obstacles: Obstacles) -> None:
        """Put obstacles, in ``base_link``, into the slots behind the vehicle's, of which there must be enough."""
        bits = np.where(obstacles.pickable, _PICKABLE, _WORLD)
        self._fill(self._slot[self._vehicle :], obstacles, bits, np.zeros_like(bits))

    def hold(self, obstacles: Obstacles) -> None:
        """Let the gripper hold some geoms, in ``tool0``.

        Raises:
            ArmError: If there are too many.
        """
        if len(obstacles) > _HELD:
            raise ArmError(f"what is held must have at most {_HELD} geoms, got {len(obstacles)}")
        count = len(obstacles)
        against = np.full(count, _LOWER | _WORLD | _PICKABLE | _VEHICLE | _REMOTE)
        self._fill(self._held, obstacles, np.zeros_like(against), against)
        for number in np.flatnonzero(obstacles.kinds == _BOX):
            geom, mesh = int(self._held[number]), int(self.model.mesh(f"held_{number}").id)
            start = int(self.model.mesh_vertadr[mesh])
            corners = self.model.mesh_vert[start : start + 8]
            corners[:] = np.sign(corners) * obstacles.sizes[number]
            self.model.geom_type[geom], self.model.geom_dataid[geom] = _MESH, mesh
        from_tool = np.linalg.norm(obstacles.positions, axis=1) + obstacles.radii
        to_tool = float(np.linalg.norm(self.model.body(TOOL).pos))
        self.held_reach = to_tool + float(from_tool.max(initial=0.0))

    def _fill(
        self, slots: IntArray, obstacles: Obstacles, kinds: IntArray, against: IntArray
    ) -> None:
        model, count = self.model, len(obstacles)
        geoms, others = slots[:count], slots[count:]
        bodies = model.geom_bodyid[geoms]
        model.geom_type[geoms] = obstacles.kinds
        model.geom_size[geoms] = obstacles.sizes
        model.geom_rbound[geoms] = obstacles.radii
        model.geom_aabb[geoms] = obstacles.bounds
        # Of a body with one geom the tree of bounding boxes is one box.
        model.bvh_aabb[model.body_bvhadr[bodies]] = obstacles.bounds
        model.body_pos[bodies] = obstacles.positions
        for number, body in enumerate(bodies):
            self.names[geoms[number]] = obstacles.names[number]
            mujoco.mju_mat2Quat(model.body_quat[body], obstacles.rotations[number].ravel())
            asset = int(obstacles.assets[number])
            if asset >= 0:
                self._give_asset(int(geoms[number]), int(body), asset)
        for attribute, values in (("contype", kinds), ("conaffinity", against)):
            of_geoms = getattr(model, f"geom_{attribute}")
            of_geoms[geoms], of_geoms[others] = values, 0
            of_bodies = getattr(model, f"body_{attribute}")
            of_bodies[bodies], of_bodies[model.geom_bodyid[others]] = values, 0

    def _give_asset(self, geom: int, body: int, asset: int) -> None:
        """Let a slot have a mesh or a height field of the world; compiling has moved the mesh in its own frame."""
        model = self.model
        if model.geom_type[geom] == _HFIELD:
            model.geom_dataid[geom] = self._fields[asset]
            return
        mesh = self._meshes[asset]
        model.geom_dataid[geom] = mesh
        position, turn = model.mesh_pos[mesh], model.mesh_quat[mesh].copy()
        moved = np.zeros(3)
        mujoco.mju_rotVecQuat(moved, position, model.body_quat[body])
        model.body_pos[body] += moved
        mujoco.mju_mulQuat(model.body_quat[body], model.body_quat[body].copy(), turn)
        # Its bounding box has turned as well: one about the sphere contains it.
        radius = model.geom_rbound[geom]
        bounds = (0.0, 0.0, 0.0, radius, radius, radius)
        model.geom_aabb[geom] = model.bvh_aabb[model.body_bvhadr[body]] = bounds

    def _numbers(self, prefix: str, count: int) -> IntArray:
        found = [int(self.model.geom(f"{prefix}{n}").id) for n in range(count)]
        return np.array(found, dtype=np.int64)


def _add_arm(spec: mujoco.MjSpec, table: ArmTable, mount: Pose) -> mujoco.MjsBody:
    """Add the arm's bodies, and return ``tool0``."""
    lower = [link.name for link in table.links[:3]]
    world = _WORLD | _PICKABLE
    above = _LOWER | world | _VEHICLE | _REMOTE
    # The mount and what turns in place above it touch the vehicle by design, and the lower links each other.
    against = dict(zip(lower, (0, world, world | _VEHICLE), strict=True))
    bodies: dict[str, mujoco.MjsBody] = {}
    for part in arm_bodies(table):
        pose = mount if part.name == ARM_BASE else part.pose
        parent = bodies.get(part.parent, spec.worldbody)
        body = bodies[part.name] = parent.add_body(
            name=part.name, pos=pose.position, quat=pose.quaternion_wxyz
        )
        kind = _LOWER if part.name in lower else 0
        if part.joint is not None:
            body.add_joint(name=part.joint.name, axis=(0.0, 0.0, 1.0))
        if part.slide is not None:
            body.add_joint(name=part.name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=part.slide)
        for solid in part.solids if part.slide is None else (_whole(part),):
            keeps = against.get(part.name, above)
            if solid.name in ("palm", "jaw"):
                keeps &= ~_PICKABLE
            geom = _add_solid(spec, body, f"{part.name}_{solid.name}", solid)
            geom.contype, geom.conaffinity = kind, keeps
    return bodies[TOOL]


def _whole(jaw: ArmBody) -> Solid:
    """Return finger and pad of a jaw, which have the same cross-section, as one box."""
    ends = np.array(
        [s.pose.position + sign * 0.5 * np.array(s.size) for s in jaw.solids for sign in (-1, 1)]
    )
    low, high = ends.min(axis=0), ends.max(axis=0)
    pose = Pose(0.5 * (low + high), np.array([1.0, 0.0, 0.0, 0.0]))
    return Solid("jaw", "box", tuple(high - low), pose, 0.0)


def _add_solid(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, solid: Solid
) -> mujoco.MjsGeom:
    geom = body.add_geom(name=name, pos=solid.pose.position, quat=solid.pose.quaternion_wxyz)
    if solid.shape == "box":
        spec.add_mesh(name=name, uservert=(_CORNERS * 0.5 * np.array(solid.size)).ravel())
        geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, name
        return geom
    radius, length = solid.size
    geom.type, geom.size = mujoco.mjtGeom.mjGEOM_CYLINDER, (radius, 0.5 * length, 0.0)
    return geom


def _add_slot(spec: mujoco.MjSpec, parent: mujoco.MjsBody, name: str) -> None:
    body = parent.add_body(name=name, mass=1.0, inertia=(1.0, 1.0, 1.0), explicitinertial=True)
    body.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_BOX, size=(1.0, 1.0, 1.0), contype=0, conaffinity=0
    )


def _add_assets(
    spec: mujoco.MjSpec, world: mujoco.MjModel | None
) -> tuple[dict[int, int], dict[int, int]]:
    """Copy the meshes and height fields of a world; return their numbers here by those there."""
    if world is None:
        return {}, {}
    used = {
        kind: set(world.geom_dataid[world.geom_type == kind].tolist()) for kind in (_MESH, _HFIELD)
    }
    for number in sorted(used[_MESH]):
        start, count = int(world.mesh_vertadr[number]), int(world.mesh_vertnum[number])
        corners = world.mesh_vert[start : start + count]
        # Of its surface alone, so that it may be flat.
        inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        spec.add_mesh(name=f"world_{number}", uservert=corners.ravel(), inertia=inertia)
    for number in sorted(used[_HFIELD]):
        rows, columns = int(world.hfield_nrow[number]), int(world.hfield_ncol[number])
        start = int(world.hfield_adr[number])
        heights = world.hfield_data[start : start + rows * columns]
        spec.add_hfield(
            name=f"world_{number}",
            size=world.hfield_size[number],
            nrow=rows,
            ncol=columns,
            userdata=heights,
        )
    # Assets keep the order in which they are added, and these are the first.
    numbers = ({n: k for k, n in enumerate(sorted(used[kind]))} for kind in (_MESH, _HFIELD))
    meshes, fields = numbers
    return meshes, fields
