"""Prebuilt point clouds of scenes: where they are stored, and loading them."""

from __future__ import annotations

from pathlib import Path

from localization.maps.cloud import Cloud, CloudError
from localization.maps.map_files import load_cloud
from robot_sim.floorplan.scene_folders import scene_names, shipped_scenes


def scene_cloud_path(scene: str) -> Path:
    """Return the path of a scene's cloud, whether or not the file exists.

    Args:
        scene: Name of a shipped scene, or path of a scene folder or of a single file (floor plan, MJCF).

    Returns:
        ``cloud.ply`` inside a scene folder; for a single file, its path with the suffix ``.ply``.
    """
    place = Path(scene)
    if scene not in scene_names() and place.is_dir():
        return place / "cloud.ply"
    if scene not in scene_names() and place.is_file():
        return place.with_suffix(".ply")
    return shipped_scenes() / scene / "cloud.ply"


def load_scene_cloud(scene: str) -> Cloud:
    """Load the prebuilt cloud of a scene; see ``scene_cloud_path``.

    Raises:
        CloudError: If the scene has no cloud; ``farsteer map`` builds one.
    """
    path = scene_cloud_path(scene)
    if not path.is_file():
        raise CloudError(f"scene {scene!r} has no cloud yet: run `farsteer map {scene}`")
    return load_cloud(path)
