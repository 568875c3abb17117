"""Ray casting: distances from any origins in any directions to the nearest surfaces."""

from robot_sim.raycasting.caster_selection import (
    SlowCastingWarning as SlowCastingWarning,
    caster_for as caster_for,
)
from robot_sim.raycasting.mujoco_caster import MujocoRayCaster as MujocoRayCaster
from robot_sim.raycasting.ray_caster import (
    NO_GEOM as NO_GEOM,
    Hits as Hits,
    RayCaster as RayCaster,
)
