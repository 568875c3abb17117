"""Writing of scene folders: plan, cloud, picture and a page that describes the scene."""

from __future__ import annotations

import shlex
from pathlib import Path

from localization.maps.cloud import Cloud
from localization.maps.map_files import save_cloud
from robot_sim.floorplan.plan import Plan
from robot_sim.floorplan.scene_folders import PLAN_FILE
from robot_sim.layout.route_planning import length
from robot_sim.layout.survey_reach import Reach
from robot_sim.worlds.from_floorplan import build_world
from robot_sim.worlds.world import World
from teleop.world_building.station_survey import survey_from_stations
from teleop.world_building.survey_drive import Progress


def write_scene(
    folder: Path,
    plan: Plan,
    text: str,
    *,
    origin: str,
    command: str,
    cloud: bool = True,
    reach: Reach | None = None,
    progress: Progress = lambda share, text: None,
) -> tuple[World, Cloud | None]:
    """Write a scene's folder and return its world and its cloud.

    Args:
        folder: The folder, which is created; files of these names in it are overwritten.
        plan: The scene's plan.
        text: The plan as TOML.
        origin: A sentence about the origin of the scene.
        command: The command that wrote it.
        cloud: Whether to survey the world and write its cloud.
        reach: What the survey reaches, which the picture shows; None leaves it out.
        progress: Called with the progress.

    Raises:
        WorldError: If the plan cannot be built.
        ImportError: If a cloud is wanted, but the library that builds it is not installed.
    """
    # Imported here, for matplotlib is slow to load.
    from teleop.world_building.plan_picture import draw_scene

    progress(0.0, "building")
    world = build_world(plan)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / PLAN_FILE).write_text(text, encoding="utf-8")
    (folder / "cloud.ply").unlink(missing_ok=True)
    mapped = None
    if cloud:
        mapped = save_cloud(survey_from_stations(world, progress=progress), folder / "cloud.ply")
    progress(1.0, "drawing")
    draw_scene(plan, mapped, folder / "picture.png", reach=reach)
    (folder / "README.md").write_text(_page(folder, world, mapped, origin, command), "utf-8")
    return world, mapped


def _page(folder: Path, world: World, cloud: Cloud | None, origin: str, command: str) -> str:
    x0, y0, x1, y1 = world.bounds
    quoted = shlex.quote(str(folder))
    about = (
        f"`cloud.ply` is its map: {len(cloud.points)} points with normals, scanned from stops along"
        f" the survey route; `farsteer map {quoted}` drives that route instead."
        if cloud is not None
        else f"It has no cloud yet: `farsteer map {quoted} --quick` makes one."
    )
    return f"""\
# {world.name}

{origin} It measures {x1 - x0:.1f} by {y1 - y0:.1f} m ({world.area:.0f} m²) and has {len(world.places)} named places, a tour
of {length(world.tour):.0f} m and a survey route of {length(world.survey):.0f} m. Made by `{command}`; edit `world.toml` as you like.

![The scene from above](picture.png)

{about}

    farsteer serve --scene {quoted}
    farsteer sim --scene {quoted}
"""
