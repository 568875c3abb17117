"""A simulated world as testers control it: the robot, and the spare boxes and people that were spawned."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping

import numpy as np

from localization.types import Pose, Twist
from robot_sim import Simulation, Spare, World, WorldError
from robot_sim.floorplan.plan import Placement
from robot_sim.layout.footprints import Footprint
from robot_sim.standing_pose import standing_pose
from teleop.robot.world_control.interface import Entity, Motion, Spawnable
from teleop.robot.world_control.results import Category, Code, ControlError, Scope, State

ROBOT = "robot"
"""Name of the robot among the entities."""
_UPRIGHT = 0.1
"""Largest roll or pitch that counts as upright [rad]."""
_REST = Twist(np.zeros(3), np.zeros(3))


class SimulatedWorld(ABC):
    """Owns the names of what was spawned; every refusal is a ``ControlError``. Subclasses say whether time goes on."""

    def __init__(self, simulation: Simulation, carried: Callable[[], object]) -> None:
        """Take the simulation; ``carried`` is called when the robot has been set down elsewhere."""
        self._sim, self._carried = simulation, carried
        self._start = simulation.truth().map_from_base
        self._spawned: dict[str, Spare] = {}

    @property
    def name(self) -> str:
        """Name of the world."""
        return self._sim.world.name

    @property
    def stamp(self) -> int:
        """Robot time [ns]."""
        return self._sim.stamp

    @property
    @abstractmethod
    def state(self) -> State:
        """Whether time goes on."""

    @property
    @abstractmethod
    def states(self) -> frozenset[State]:
        """States that can be set."""

    @abstractmethod
    def set_state(self, state: State) -> None:
        """Let time go on, or pause it; only states of ``states`` are asked for."""

    @property
    def entities(self) -> Mapping[str, Entity]:
        """The robot, and what was spawned, by name."""
        found = {ROBOT: Entity(ROBOT, Category.ROBOT, self._robot_text, ("mobile_robot",))}
        for name, spare in self._spawned.items():
            found[name] = Entity(name, _category(spare), _text(spare), (spare.kind, "spawned"))
        return found

    @property
    def _robot_text(self) -> str:
        robot = self._sim.world.robot
        return f"skid-steer robot {robot.length:g} m long; its frame is base_link"

    def motion(self, name: str) -> Motion:
        """Return where an entity of ``entities`` is."""
        if name == ROBOT:
            truth = self._sim.truth()
            rotation = truth.map_from_base.rotation
            twist = Twist(rotation @ truth.twist.linear, rotation @ truth.twist.angular)
            return Motion(truth.map_from_base, twist)
        at = self._sim.spares.standing[self._spawned[name].name]
        pose = Pose.from_euler(np.array([at.x, at.y, at.z]), yaw=at.yaw)
        return Motion(pose, _REST)

    def move(self, name: str, map_from_entity: Pose) -> None:
        """Put an entity of ``entities`` down at rest elsewhere; it stands on the ground, and only turns about z."""
        self._put(name, map_from_entity, Code.POSE_INVALID)

    @property
    def spawnables(self) -> Mapping[str, Spawnable]:
        """What can be spawned, by its address."""
        return {
            _uri(spare): Spawnable(_uri(spare), _category(spare), _text(spare), spare.size)
            for spare in self._sim.world.spares
        }

    def spawn(self, uri: str, name: str, map_from_entity: Pose) -> None:
        """Put something of ``spawnables`` down, under a name that nothing has yet."""
        spares = self._sim.spares
        free = [spare for spare in spares.parked if _uri(spare) == uri]
        if not free:
            count = sum(_uri(spare) == uri for spare in spares.all)
            raise ControlError(
                Code.FAILED, f"all {count} of {uri} are in the world; delete one of them first"
            )
        self._spawned[name] = free[0]
        try:
            self._put(name, map_from_entity, Code.SPAWN_POSE_INVALID)
        except ControlError:
            del self._spawned[name]
            raise

    def remove(self, name: str) -> None:
        """Take a spawned entity away."""
        if name == ROBOT:
            raise ControlError(Code.FAILED, "the robot cannot be deleted; only what was spawned")
        self._sim.spares.remove(self._spawned.pop(name).name)

    def reset(self, scope: Scope) -> None:
        """Put the robot at its start (``Scope.STATE``), or take away what was spawned (``Scope.SPAWNED``), or both."""
        if Scope.SPAWNED in scope:
            for name in list(self._spawned):
                self.remove(name)
        if Scope.STATE in scope:
            try:
                self._carry_robot(self._start)
            except WorldError as error:
                raise ControlError(Code.FAILED, str(error)) from None

    @property
    def named_poses(self) -> Mapping[str, tuple[Pose, tuple[str, ...]]]:
        """Poses that the world knows by name, each with its tags."""
        world = self._sim.world
        spawns = {name: (pose, ("spawn",)) for name, pose in world.spawns.items()}
        return {
            **spawns,
            **{name: (pose, ("navigation_goal",)) for name, pose in world.places.items()},
        }

    def _carry_robot(self, map_from_base: Pose) -> None:
        self._sim.carry_to(map_from_base)
        self._carried()

    def _put(self, name: str, pose: Pose, invalid: int) -> None:
        simulation = self._sim
        at = _placement(simulation.world, pose, invalid)
        try:
            if name == ROBOT:
                self._carry_robot(standing_pose(simulation.world, at.x, at.y, at.yaw))
            else:
                spare = self._spawned[name]
                _refuse_robot(simulation, spare, at, invalid)
                simulation.spares.put(spare.name, at)
        except WorldError as error:
            raise ControlError(invalid, str(error)) from None


def _placement(world: World, pose: Pose, invalid: int) -> Placement:
    x, y, _ = pose.position.tolist()
    roll, pitch, yaw = pose.euler
    if max(abs(roll), abs(pitch)) > _UPRIGHT:
        raise ControlError(
            invalid,
            f"it stands upright: roll and pitch must be 0, got {roll:.2f} and {pitch:.2f} rad",
        )
    x0, y0, x1, y1 = world.bounds
    if not (x0 <= x <= x1 and y0 <= y <= y1):
        raise ControlError(
            invalid,
            f"x {x:.2f}, y {y:.2f} is off the floor, which reaches from {x0:g}, {y0:g} to {x1:g}, {y1:g}",
        )
    return Placement(x, y, yaw)


def _refuse_robot(simulation: Simulation, spare: Spare, at: Placement, invalid: int) -> None:
    half = (0.5 * spare.size[0], 0.5 * spare.size[1])
    there = simulation.truth().map_from_base.position[:2]
    robot = simulation.world.robot
    if Footprint(at.x, at.y, half, at.yaw).distance(there) < robot.half_width:
        x, y = there.tolist()
        raise ControlError(invalid, f"the robot stands there, at x {x:.2f}, y {y:.2f}")


def _uri(spare: Spare) -> str:
    if spare.kind == "person":
        return "person"
    return "box_" + "x".join(f"{side:g}" for side in spare.size)


def _category(spare: Spare) -> Category:
    return Category.HUMAN if spare.kind == "person" else Category.STATIC_OBJECT


def _text(spare: Spare) -> str:
    length, width, height = spare.size
    if spare.kind == "person":
        return f"a person who stands, {height:g} m tall"
    return f"a box of cardboard, {length:g} m long, {width:g} m wide, {height:g} m high"
