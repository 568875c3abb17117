"""Spare bodies of one simulation: boxes and people that it puts somewhere, moves and takes away as it runs."""

from __future__ import annotations

from collections.abc import Callable

from robot_sim.actors.extras import Spare
from robot_sim.actors.schedules import OpenSchedule, Standing
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan_ground import height_at
from robot_sim.scene_objects.plan_elements import Placement
from robot_sim.worlds.world import World


class SpareBodies:
    """Owns the schedules of a world's spares; each change holds from the present time on."""

    def __init__(self, world: World, now: Callable[[], int]) -> None:
        """Take the spares of a world, all parked; ``now`` returns the simulation's time [ns]."""
        self._spares = {spare.name: spare for spare in world.spares}
        self._ground, self._now = world.ground, now
        self._schedules = {name: OpenSchedule(name) for name in self._spares}
        self._standing: dict[str, Standing] = {}
        self.on_change: Callable[[], object] = lambda: None
        """Called when a body has been put somewhere or taken away."""

    @property
    def movers(self) -> tuple[OpenSchedule, ...]:
        """The bodies' movers."""
        return tuple(self._schedules.values())

    @property
    def all(self) -> tuple[Spare, ...]:
        """All spares."""
        return tuple(self._spares.values())

    @property
    def parked(self) -> tuple[Spare, ...]:
        """Those that are nowhere now."""
        return tuple(s for name, s in self._spares.items() if name not in self._standing)

    @property
    def standing(self) -> dict[str, Standing]:
        """Where the others stand, by name."""
        return dict(self._standing)

    def put(self, name: str, at: Placement) -> None:
        """Put a spare somewhere on the ground, or elsewhere.

        Raises:
            WorldError: There is no spare of this name.
        """
        pose = Standing(at.x, at.y, height_at(self._ground, at.x, at.y), at.yaw)
        self._schedule(name).add(self._now(), pose.pose_at)
        self._standing[name] = pose
        self.on_change()

    def remove(self, name: str) -> None:
        """Take a spare away.

        Raises:
            WorldError: There is no spare of this name.
        """
        self._schedule(name).add(self._now(), None)
        self._standing.pop(name, None)
        self.on_change()

    def _schedule(self, name: str) -> OpenSchedule:
        if name not in self._schedules:
            raise WorldError(
                f"no spare body {name!r}; there are: {', '.join(self._schedules) or 'none'}"
            )
        return self._schedules[name]
