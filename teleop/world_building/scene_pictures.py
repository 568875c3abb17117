"""Pictures of the scenes for their pages: a rendering of each world, and its cloud from the same viewpoint.

``MUJOCO_GL=egl python -m teleop.world_building.scene_pictures [SCENE ...]`` in the repository draws them
again, to ``docs/images/world_<scene>.jpg``.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Final

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from localization.maps.cloud import Cloud
from robot_sim import load_world, scene_names
from robot_sim.survey.rendering import Viewpoint, render_world
from robot_sim.worlds.world import World
from teleop.scene_clouds import load_scene_cloud

_SIZE: Final = (1000, 640)
"""Width and height of each half [pixels]."""
_PAPER: Final = 255
_HIDDEN: Final[dict[str, tuple[str, ...]]] = {
    "corridor": ("ceiling", "west", "corridor_south", "south"),
    "warehouse": ("ceiling", "west", "south"),
    "courtyard": ("ceiling", "south", "arcade_roof"),
    "glasshouse": ("ceiling", "roof_slope"),
}
"""Geoms that would hide the scene from the camera."""
_CAMERAS: Final = {
    "corridor": Viewpoint((13.0, 4.0, 0.0), 19.0, math.radians(8.0), math.radians(24.0)),
    "warehouse": Viewpoint((27.5, 16.0, 1.0), 50.0, math.radians(72.0), math.radians(40.0)),
    "courtyard": Viewpoint((20.0, 13.5, 0.5), 40.0, math.radians(80.0), math.radians(42.0)),
    "glasshouse": Viewpoint((20.0, 10.8, 1.0), 31.0, math.radians(76.0), math.radians(42.0)),
}
_OVERHEAD: Final = math.radians(62.0)


def camera_for(world: World) -> Viewpoint:
    """Return the camera of a world: chosen by hand, or one above all of it."""
    x0, y0, x1, y1 = world.bounds
    middle = (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0)
    far = 1.05 * max(x1 - x0, 1.5 * (y1 - y0))
    return _CAMERAS.get(world.name, Viewpoint(middle, far, 0.5 * math.pi, _OVERHEAD))


def draw_cloud(cloud: Cloud, camera: Viewpoint, *, highest: float) -> npt.NDArray[np.uint8]:
    """Return a cloud as seen by a camera, coloured by height, (height, width, 3).

    Args:
        cloud: The cloud, in ``map``.
        camera: The viewpoint.
        highest: Height above which points are dropped [m]; the colours span the rest.
    """
    width, height = _SIZE
    points = cloud.points[cloud.points[:, 2] < highest]
    # Only surfaces that face the camera: the backs of walls would hide the rooms.
    eye = np.array(camera.at) - camera.distance * camera.axes[2]
    facing = np.einsum("ij,ij->i", cloud.normals[cloud.points[:, 2] < highest], eye - points) > 0.0
    points = points[facing]
    pixels, depth, seen = camera.project(points, width, height)
    order = np.flatnonzero(seen)[np.argsort(-depth[seen], kind="stable")]
    share = np.clip(points[order, 2] / highest, 0.0, 1.0)
    colours = (matplotlib.colormaps["viridis"](share)[:, :3] * 255).astype(np.uint8)
    canvas = np.full((height, width, 3), _PAPER, dtype=np.uint8)
    x, y = pixels[order].astype(int).T
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        canvas[np.minimum(y + dy, height - 1), np.minimum(x + dx, width - 1)] = colours
    return canvas


def draw(world: World, cloud: Cloud, path: Path) -> None:
    """Draw world and cloud side by side and save them as JPEG."""
    camera = camera_for(world)
    width, height = _SIZE
    hidden = _HIDDEN.get(world.name, ("ceiling",))
    room = world.plan.height if world.plan is not None else 3.0
    highest = room - 0.1 if world.plan is not None and world.plan.ceiling else 7.0
    halves = (
        render_world(world, camera, width=width, height=height, hidden=hidden),
        draw_cloud(cloud, camera, highest=highest),
    )
    titles = (
        f"{world.name}: {world.area:.0f} m², {world.model.ngeom} solids",
        f"its cloud: {len(cloud.points):,} points, coloured by height",
    )
    matplotlib.rcParams["font.size"] = 9
    figure = Figure(figsize=(13.0, 4.5), layout="constrained")
    for i, (half, title) in enumerate(zip(halves, titles, strict=True)):
        axes = figure.add_subplot(1, 2, i + 1)
        axes.imshow(half)
        axes.set_title(title, fontsize=9)
        axes.set_axis_off()
    figure.savefig(path, dpi=100, pil_kwargs={"quality": 78, "optimize": True})


def main(names: list[str]) -> None:
    """Draw the named scenes, or all."""
    folder = Path(__file__).parents[2] / "docs" / "images"
    for name in names or scene_names():
        draw(load_world(name), load_scene_cloud(name), folder / f"world_{name}.jpg")


if __name__ == "__main__":
    main(sys.argv[1:])
