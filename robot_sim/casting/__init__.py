"""Ray casting: from anywhere in any direction to the nearest surface."""

from robot_sim.casting.caster import (
    NO_GEOM as NO_GEOM,
    Hits as Hits,
    RayCaster as RayCaster,
)
from robot_sim.casting.choice import (
    SlowCastingWarning as SlowCastingWarning,
    caster_for as caster_for,
)
from robot_sim.casting.native import MujocoRayCaster as MujocoRayCaster
