"""The pictures of docs/cameras.md: ``python -m benchmarks.pictures.cameras FOLDER`` draws them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.camera.scenes import moved
from localization.types import Pose
from robot_sim import Simulation, WorldOptions, load_world
from robot_sim.cameras import CAMERAS
from robot_sim.cameras.renderer import CameraRenderer

VIEWS = (
    ("office", (13.4, 2.8, 168.0)),
    ("warehouse", (8.0, 5.0, 25.0)),
    ("courtyard", (8.0, 6.0, 40.0)),
    ("glasshouse", (12.0, 7.5, 10.0)),
)
"""Scenes of the documentation's picture, with x, y [m] and yaw [deg] of the robot."""
WIDTH = 400
"""Width of each of them [pixels]."""


def draw(folder: Path) -> None:
    """Draw the views side by side, and one view with its depth."""
    frames = []
    for name, (x, y, yaw) in VIEWS:
        world = load_world(name, options=WorldOptions(alive=True))
        simulation = Simulation(world)
        for _ in range(50):
            simulation.step()
        pose = Pose.from_euler((x, y, 0.0), yaw=float(np.radians(yaw)))
        with CameraRenderer(world, CAMERAS["kinect"]) as renderer:
            frames.append(renderer.render(moved(simulation, pose)))
    scaled = [np.asarray(_small(frame.rgb)) for frame in frames]
    rows = [np.hstack(scaled[i : i + 2]) for i in (0, 2)]
    Image.fromarray(np.vstack(rows)).save(folder / "camera_scenes.jpg", quality=80)
    depth = np.nan_to_num(frames[0].depth, nan=0.0)
    grey = np.where(depth > 0.0, 255.0 * (1.0 - depth / 11.0), 0.0).astype(np.uint8)
    pair = np.hstack([scaled[0], np.asarray(_small(np.repeat(grey[..., None], 3, axis=2)))])
    Image.fromarray(pair).save(folder / "camera_depth.jpg", quality=80)


def _small(image: np.ndarray) -> Image.Image:
    height = round(WIDTH * image.shape[0] / image.shape[1])
    return Image.fromarray(image).resize((WIDTH, height), Image.Resampling.LANCZOS)


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
