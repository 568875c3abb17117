"""Selection of a simulation's ray caster: Embree if installed, otherwise MuJoCo."""

from __future__ import annotations

import functools
import importlib.util
import warnings
import weakref
from typing import TYPE_CHECKING

import mujoco

from robot_sim.raycasting.mujoco_caster import MujocoRayCaster
from robot_sim.raycasting.ray_caster import RayCaster
from robot_sim.raycasting.static_digest import static_digest
from robot_sim.worlds.world import World

if TYPE_CHECKING:
    from robot_sim.raycasting.embree_scene import StaticGeometry

_STATIC: weakref.WeakKeyDictionary[mujoco.MjModel, StaticGeometry] = weakref.WeakKeyDictionary()
_ALIKE: weakref.WeakValueDictionary[bytes, StaticGeometry] = weakref.WeakValueDictionary()
"""The same by digest, for worlds that differ only in what comes at its time."""


class SlowCastingWarning(UserWarning):
    """Embree is not installed, so that ray casting is slower."""


def caster_for(world: World, data: mujoco.MjData) -> RayCaster:
    """Return the fastest available caster for a world, with ``data`` for moving geometry.

    The static geometry is prepared once per world, and shared by worlds in which all that stands still is the same. Without ``embreex`` (no wheel for this
    machine, or the extra is not installed) MuJoCo casts, after one warning.
    """
    if not _embree_is_there():
        return MujocoRayCaster(world.model, data, world.movers)
    from robot_sim.raycasting.embree_caster import EmbreeRayCaster
    from robot_sim.raycasting.embree_scene import StaticGeometry

    static = _STATIC.get(world.model)
    if static is None:
        digest = static_digest(world.model)
        static = _ALIKE.get(digest) or StaticGeometry(world.model)
        _STATIC[world.model] = _ALIKE[digest] = static
    return EmbreeRayCaster(static, world.model, data, world.movers)


@functools.cache
def _embree_is_there() -> bool:
    """Return whether Embree can be used, and warn once if not."""
    if importlib.util.find_spec("embreex") is not None:
        return True
    warnings.warn(
        "embreex is not installed: scanners are cast by MuJoCo, which is slower"
        " (the extra `sim` brings it on x86-64)",
        SlowCastingWarning,
        stacklevel=3,
    )
    return False
