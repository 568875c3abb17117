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
        scene: Name of a scene that comes with the project, or path of a scene's folder or of a floor plan
            (``.toml``).

    Raises:
        UnknownSceneError: no scene has this name; the message lists the available ones.
        WorldError: the plan cannot be read or is invalid.
    """
    path = Path(scene)
    name = path.stem
    if path.suffix != ".toml":
        folder = scene_folder(scene)
        path, name = folder / PLAN_FILE, folder.name
    try:
        text = path.read_text(encoding="utf-8-sig")  # editors on Windows begin it with a mark
    except (OSError, UnicodeDecodeError) as error:
        raise WorldError(f"cannot read the floor plan {str(path)!r}: {error}") from None
    return plan_from_toml(text, name=name)


def load_world(
    name: str,
    *,
    robot: SkidSteer | None = None,
    options: WorldOptions = AS_MAPPED,
) -> World:
    """Build the world of a scene.

    Args:
        name: Name of a scene that comes with the project, or path of a scene's folder, of a floor
            plan (``.toml``) or of an MJCF file (``.xml``).
        robot: Robot that is compiled into the world; a P3-AT by default.
        options: Differences from the mapped world; of an MJCF file neither ``alive`` nor ``rearranged``, nor
            closed doors and parcels.

    Raises:
        UnknownSceneError: no scene has this name; the message lists the available ones.
        WorldError: the world cannot be built.
    """
    path = Path(name)
    if path.suffix == ".xml":
        if options.parcels:
            raise WorldError(
                f"{path.name}: an MJCF file has its own loose bodies, and takes no parcels"
            )
        if options.alive or options.rearranged is not None:
            raise WorldError(
                f"{path.name}: an MJCF file cannot be alive or rearranged; what moves in it is set by its"
                " joints"
            )
        return load_mjcf(path, robot=robot, options=options)
    return build_world(load_plan(name), robot=robot, options=options)


def parse_world(
    text: str,
    *,
    name: str,
    robot: SkidSteer | None = None,
    options: WorldOptions = AS_MAPPED,
) -> World:
    """Build a world from the text of a floor plan; arguments and errors as for ``load_world``."""
    return build_world(plan_from_toml(text, name=name), robot=robot, options=options)
