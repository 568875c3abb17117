"""Renderers that are made once: building one takes longer than drawing."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from robot_sim.cameras import CAMERAS, CameraModel
from robot_sim.cameras.renderer import CameraRenderer, CameraScene
from robot_sim.errors import CameraUnavailableError
from robot_sim.worlds.world import World

Make = Callable[..., CameraRenderer]


@pytest.fixture(scope="session")
def make_renderer() -> Iterator[Make]:
    """Make renderers; in CI there must be a graphics library."""
    made: dict[object, CameraRenderer] = {}

    def make(scene: World | CameraScene, model: CameraModel = CAMERAS["small"]) -> CameraRenderer:
        key = (id(scene), model)
        if key not in made:
            try:
                made[key] = CameraRenderer(scene, model)
            except CameraUnavailableError as error:
                pytest.skip(str(error))
        return made[key]

    yield make
    for renderer in made.values():
        renderer.close()
