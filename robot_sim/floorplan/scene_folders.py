"""Folders of scenes: those of the project by name, others by path."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from robot_sim.errors import UnknownSceneError, WorldError

PLAN_FILE: Final = "world.toml"
"""Name of the floor plan in a scene's folder."""


def scene_names() -> tuple[str, ...]:
    """Return the names of the scenes that come with the project, sorted."""
    return tuple(sorted(f.name for f in shipped_scenes().iterdir() if (f / PLAN_FILE).is_file()))


def scene_folder(scene: str) -> Path:
    """Return the folder of a scene, which contains a floor plan.

    Args:
        scene: Name of a scene that comes with the project, or path of a scene's folder.

    Raises:
        UnknownSceneError: there is no such scene; the message lists the available names.
        WorldError: the folder contains no floor plan.
    """
    if scene in scene_names():
        return shipped_scenes() / scene
    folder = Path(scene)
    if (folder / PLAN_FILE).is_file():
        return folder.resolve()
    if folder.is_dir():
        raise WorldError(
            f"folder {scene!r} is not a scene: it has no {PLAN_FILE};"
            " `farsteer world generate` and `farsteer world from-map` create such folders"
        )
    raise UnknownSceneError(scene, scene_names())


def shipped_scenes() -> Path:
    """Return the folder of the scenes that come with the project.

    A wheel has them inside this package; in the repository they are a folder beside it.
    """
    package = Path(__file__).parents[1]
    installed = package / "scenes"
    return installed if installed.is_dir() else package.parent / "scenes"
