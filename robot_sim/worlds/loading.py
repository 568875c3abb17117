"""Load a world by the name of a scene, the path of a floor plan or the path of an MJCF file."""

from __future__ import annotations

from pathlib import Path

from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Plan
from robot_sim.floorplan.scene_folders import PLAN_FILE, scene_folder
from robot_sim.floorplan.toml_reader import plan_from_toml
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.worlds.from_floorplan import build_world
from robot_sim.worlds.from_mjcf import load_mjcf
from robot_sim.worlds.world import AS_MAPPED, World, WorldOptions


def load_plan(scene: str) -> Plan:
    """Read the plan of a scene.

    Args:
        scene: the name of one that comes with the project, or the path of any other's folder.

    Raises:
        UnknownSceneError: there is no such scene; the message lists those there are.
        WorldError: it makes no sense.
    """
    folder = scene_folder(scene)
    return plan_from_toml((folder / PLAN_FILE).read_text(encoding="utf-8"), name=folder.name)


def load_world(
    name: str,
    *,
    robot: SkidSteer | None = None,
    options: WorldOptions = AS_MAPPED,
) -> World:
    """Build the world of a scene.

    Args:
        name: Of one that comes with the project, the path of any other's folder, or that of a
            floor plan (``.toml``) or of an MJCF file (``.xml``).
        robot: Compiled into the world.
        options: What is different about it today.

    Raises:
        UnknownSceneError: there is no such scene; the message lists those there are.
        WorldError: its floor plan cannot be built.
    """
    path = Path(name)
    if path.suffix == ".xml":
        if options != AS_MAPPED:
            raise WorldError(
                f"{path.name}: an MJCF has no options; it moves what its joints let move"
            )
        return load_mjcf(path, robot=robot)
    if path.suffix == ".toml":
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise WorldError(f"cannot read the floor plan {name!r}: {error}") from None
        return parse_world(text, name=path.stem, robot=robot, options=options)
    return build_world(load_plan(name), robot=robot, options=options)


def parse_world(
    text: str,
    *,
    name: str,
    robot: SkidSteer | None = None,
    options: WorldOptions = AS_MAPPED,
) -> World:
    """Build a world from the text of a floor plan; see ``load_world`` for the rest."""
    return build_world(plan_from_toml(text, name=name), robot=robot, options=options)
