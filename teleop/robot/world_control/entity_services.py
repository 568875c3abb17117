"""The services of ``simulation_interfaces`` about entities: what there is, where it is, and what comes and goes."""

from __future__ import annotations

import re
from itertools import count
from typing import Any, Final

from localization.logs.ros_geometry import pose_from_message, pose_to_dict
from localization.types import InvalidReadingError, Pose, Twist
from robot_sim.errors import nearest
from teleop.robot.topics.message_parts import header, twist_to_dict
from teleop.robot.world_control.answers import Answer, Request, answered
from teleop.robot.world_control.entity_filters import has_tags, matching
from teleop.robot.world_control.results import Code, ControlError, result
from teleop.robot.world_control.simulated_entities import SimulatedWorld

_FRAMES: Final = ("", "map", "world")
"""Names of the world's frame."""
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")


class EntityServices:
    """Answers what concerns the entities of a world."""

    def __init__(self, control: SimulatedWorld) -> None:
        """Answer for a world."""
        self._control = control

    @property
    def answers(self) -> dict[str, Answer]:
        """What answers each service, by its type's name."""
        return {
            "GetEntities": self._entities,
            "GetEntitiesStates": self._entities_states,
            "GetEntityInfo": self._info,
            "GetEntityState": self._entity_state,
            "SetEntityState": self._set_entity_state,
            "SpawnEntity": self._spawn,
            "SpawnEntities": self._spawn_several,
            "DeleteEntity": self._delete,
            "GetSpawnables": self._spawnables,
            "GetNamedPoses": self._named_poses,
        }

    def _entities(self, request: Request) -> Request:
        return {"entities": matching(self._control.entities, request["filters"])}

    def _entities_states(self, request: Request) -> Request:
        names = matching(self._control.entities, request["filters"])
        return {"entities": names, "states": [self._state_of(name) for name in names]}

    def _info(self, request: Request) -> Request:
        entity = self._control.entities[self._known(request["entity"])]
        return {
            "info": {
                "category": {"category": int(entity.category)},
                "description": entity.description,
                "tags": list(entity.tags),
            }
        }

    def _entity_state(self, request: Request) -> Request:
        return {"state": self._state_of(self._known(request["entity"]))}

    def _set_entity_state(self, request: Request) -> Request:
        name, state = self._known(request["entity"]), request["state"]
        parts = [request[part] for part in ("set_pose", "set_twist", "set_acceleration")]
        # Clients of version 2.0 know no such parts, and mean the pose.
        set_pose = request["set_pose"] or not any(parts)
        for part in ("twist", "acceleration"):
            if request[f"set_{part}"] and _moves(state[part]):
                raise ControlError(
                    Code.FAILED, f"{name} is set down at rest: its {part} must be 0 or not be set"
                )
        if set_pose:
            self._control.move(name, _pose(state, Code.POSE_INVALID))
        return {}

    def _spawn(self, request: Request) -> Request:
        uri, text = request["entity_resource"]["uri"], request["entity_resource"]["resource_string"]
        spawnables = self._control.spawnables
        if not uri and text:
            raise ControlError(
                Code.UNSUPPORTED_FORMAT,
                "resource_string is not read here; give a uri of GetSpawnables",
            )
        if not uri:
            raise ControlError(Code.NO_RESOURCE, f"no uri; there are: {_listed(spawnables)}")
        if uri not in spawnables:
            raise ControlError(
                Code.NOT_FOUND,
                f"nothing has the uri {uri[:80]!r}; there are: {_listed(spawnables)}",
            )
        if request["entity_namespace"]:
            raise ControlError(
                Code.NAMESPACE_INVALID, "boxes and people have no topics; leave the namespace empty"
            )
        name = self._free_name(request["name"], uri, renaming=request["allow_renaming"])
        pose = _pose(request["initial_pose"], Code.SPAWN_POSE_INVALID)
        self._control.spawn(uri, name, pose)
        return {"entity_name": name}

    def _spawn_several(self, request: Request) -> Request:
        results = [answered(self._spawn, each) for each in request["spawn_requests"]]
        if all(each["result"]["result"] == Code.OK for each in results):
            return {"results": results}
        text = "some were not spawned; their results say why"
        return {"result": result(Code.SOME_NOT_SPAWNED, text), "results": results}

    def _delete(self, request: Request) -> Request:
        self._control.remove(self._known(request["entity"]))
        return {}

    def _spawnables(self, request: Request) -> Request:
        return {
            "spawnables": [
                {
                    "entity_resource": {"uri": each.uri, "resource_string": ""},
                    "description": each.description,
                    "spawn_bounds": _box(each.size),
                }
                for each in self._control.spawnables.values()
            ]
        }

    def _named_poses(self, request: Request) -> Request:
        return {
            "poses": [
                {"name": name, "description": "", "tags": list(tags), "pose": pose_to_dict(pose)}
                for name, (pose, tags) in self._control.named_poses.items()
                if has_tags(tags, request["tags"])
            ]
        }

    def _state_of(self, name: str) -> Request:
        motion = self._control.motion(name)
        return {
            "header": header(self._control.stamp, "map"),
            "pose": pose_to_dict(motion.map_from_entity),
            "twist": twist_to_dict(motion.twist),
            "acceleration": twist_to_dict(Twist.planar(0.0, 0.0)),
        }

    def _known(self, name: str) -> str:
        entities = self._control.entities
        if name in entities:
            return name
        name = name[:80]
        raise ControlError(Code.NOT_FOUND, f"no entity {name!r}; {nearest(name, entities)}")

    def _free_name(self, name: str, uri: str, *, renaming: bool) -> str:
        entities = self._control.entities
        if name and not _NAME.fullmatch(name):
            raise ControlError(
                Code.NAME_INVALID,
                "a name has up to 64 letters, digits and _, and begins with a letter",
            )
        if name and name not in entities:
            return name
        if not renaming:
            code = Code.NAME_NOT_UNIQUE if name else Code.NAME_INVALID
            why = f"an entity is named {name!r} already" if name else "the name is empty"
            raise ControlError(code, f"{why}; give another, or set allow_renaming")
        stem = name or uri.partition("_")[0]
        return next(each for n in count(1) if (each := f"{stem}_{n}") not in entities)


def _pose(stamped: Request, invalid: int) -> Pose:
    frame = stamped["header"]["frame_id"].removeprefix("/")
    if frame not in _FRAMES:
        raise ControlError(
            invalid,
            f"poses are in the world's frame: frame_id must be map or empty, got {frame[:80]!r}",
        )
    try:
        return pose_from_message(stamped["pose"])
    except InvalidReadingError as error:
        raise ControlError(invalid, str(error)) from None


def _moves(twist: Request) -> bool:
    return any(value != 0.0 for part in twist.values() for value in part.values())


def _box(size: tuple[float, float, float]) -> Request:
    """Return the ``Bounds`` of a box that stands on the origin."""
    x, y, z = 0.5 * size[0], 0.5 * size[1], size[2]
    corners = [{"x": x, "y": y, "z": z}, {"x": -x, "y": -y, "z": 0.0}]
    return {"type": 1, "points": corners}


def _listed(names: Any) -> str:
    return ", ".join(names) or "none"
