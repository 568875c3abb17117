"""The sky around a world, and the lights in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import mujoco
import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.cameras.look.pattern_noise import Image, noise, pixels

_SIZE: Final = 256
"""Side of a face of the sky [pixels]."""
_CLOUDS: Final = 512
"""Side of the layer of clouds, which repeats [pixels]."""
_ZENITH: Final = np.array((0.26, 0.47, 0.77))
_HORIZON: Final = np.array((0.78, 0.86, 0.93))
_LAND: Final = np.array((0.45, 0.50, 0.38))
_HAZE: Final = np.array((0.72, 0.78, 0.80))


@dataclass(frozen=True, slots=True)
class Light:
    """Light from one direction."""

    direction: tuple[float, float, float]
    """Direction in which it shines."""
    diffuse: float
    """Brightness on matt surfaces, 0 to 1."""
    specular: float = 0.0
    """Brightness of highlights, 0 to 1."""
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Colour."""


INDOORS: Final = (
    Light((0.35, 0.25, -0.9), 0.42, 0.25),
    Light((-0.6, -0.75, -0.25), 0.30),
    Light((0.75, -0.45, 0.3), 0.24),
)
"""Lamps overhead, and what walls and floor throw back."""
OUTDOORS: Final = (
    Light((0.55, 0.35, -0.75), 0.66, 0.35, (1.0, 0.96, 0.88)),
    Light((-0.6, -0.7, -0.3), 0.24, 0.0, (0.85, 0.92, 1.0)),
)
"""The sun, and the sky opposite it."""
AMBIENT: Final = {True: 0.50, False: 0.46}
"""Light from everywhere, indoors and outdoors."""


@cache
def sky() -> Image:
    """Return the six faces of a sky with clouds above hazy land, one under the other, as MuJoCo has them."""
    axis = (np.arange(_SIZE) + 0.5) / _SIZE * 2.0 - 1.0
    u, v = np.meshgrid(axis, -axis)
    one = np.ones_like(u)
    # Right, left, up, down, front, back, each as a direction (x right, y up, z towards the viewer).
    faces = (
        (one, v, -u), (-one, v, u), (u, one, -v), (u, -one, v), (u, v, one), (-u, v, -one),
    )  # fmt: skip
    clouds = noise(_CLOUDS, 1.7, 60)
    return np.concatenate([_colours(np.stack(face, axis=-1), clouds) for face in faces])


def _colours(direction: FloatArray, clouds: FloatArray) -> Image:
    unit = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    up = unit[..., 1]
    rise = np.clip(up, 0.0, 1.0)[..., None] ** 0.55
    air = _HORIZON + rise * (_ZENITH - _HORIZON)
    # Clouds lie in a level layer.
    layer = unit[..., [0, 2]] / np.maximum(up, 0.06)[..., None]
    i, j = ((layer * _CLOUDS * 0.11).astype(int) % _CLOUDS).transpose(2, 0, 1)
    cover = np.clip(0.75 * (clouds[i, j] - 0.35), 0.0, 0.9) * np.clip(6.0 * up, 0.0, 1.0)
    air += cover[..., None] * (np.array((0.97, 0.97, 0.97)) - air)
    fall = np.clip(-up * 5.0, 0.0, 1.0)[..., None]
    land = _HAZE + fall * (_LAND - _HAZE)
    blend = np.clip(0.5 + 80.0 * up, 0.0, 1.0)[..., None]
    return pixels(land + blend * (air - land))


def add_sky(spec: mujoco.MjSpec) -> None:
    """Add the sky to a specification."""
    image = sky()
    added = spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        width=_SIZE,
        height=6 * _SIZE,
        nchannel=3,
    )
    added.data = image.tobytes()


def add_lights(spec: mujoco.MjSpec, *, indoors: bool) -> None:
    """Add the lights of a building or of the open to a specification; none casts shadows."""
    head = spec.visual.headlight
    head.ambient[:] = AMBIENT[indoors]
    head.diffuse[:] = 0.08
    head.specular[:] = 0.0
    for light in INDOORS if indoors else OUTDOORS:
        spec.worldbody.add_light(
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            dir=light.direction,
            pos=(0.0, 0.0, 10.0),
            ambient=(0.0, 0.0, 0.0),
            diffuse=[light.diffuse * c for c in light.tint],
            specular=(light.specular,) * 3,
            castshadow=False,
        )
