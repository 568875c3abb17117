"""A 2-D Monte-Carlo localiser in the manner of AMCL, as the peer that most robots run.

Particles (x, y, yaw) are moved by odometry with noise in proportion to the motion, weighed by a
likelihood field at the horizontal scanner's height, and drawn anew, as many as KLD sampling (Fox 2003)
asks for. Models are those of Thrun, Burgard and Fox, *Probabilistic Robotics*, tables 5.6 and 6.3;
the numbers are nav2_amcl's defaults. It is given more than AMCL usually gets: deskewed sweeps, odometry
of gyro and wheels with learned scale, and the true pose to begin with.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray, wrap_angle
from localization.maps.prepared_map import PreparedMap
from localization.relocalization.floor_plan import FloorPlan, level_points
from localization.types import Pose, Sweep


@dataclass(frozen=True, slots=True)
class MonteCarloConfig:
    """nav2_amcl's defaults."""

    least: int = 500
    """Particles."""
    most: int = 2000
    """Particles."""
    motion_noise: float = 0.2
    """alpha1 to alpha4: variance of turning and way by turning and way."""
    beams: int = 60
    """Of each sweep."""
    sigma: float = 0.2
    """Of the likelihood field [m]."""
    hit: float = 0.5
    """Weight of the field."""
    random: float = 0.5
    """Weight of readings that could be anything."""
    farthest: float = 2.0
    """Distances to the nearest wall are cut off here [m]."""
    range_max: float = 20.0
    """Over which random readings spread [m]."""
    way: float = 0.25
    """Sweeps are used after so much way [m] ..."""
    turn: float = 0.2
    """... or so much turning [rad]."""
    error: float = 0.05
    """KLD sampling: bound of the divergence ..."""
    quantile: float = 2.326
    """... kept to with 99 %: the standard normal's quantile."""
    bin: float = 0.5
    """Of the histogram that KLD sampling counts [m]."""
    bin_yaw: float = np.deg2rad(10.0)
    """The same for heading [rad]."""


class MonteCarlo:
    """The particles; owns them and their source of chance."""

    def __init__(
        self,
        world: PreparedMap,
        start: Pose,
        odom_from_base: Pose,
        *,
        height: float,
        seed: int = 0,
        config: MonteCarloConfig = MonteCarloConfig(),
    ) -> None:
        self.config = config
        self._plan = FloorPlan(world, height, cell=0.05, sigma=config.sigma)
        floor = float(np.exp(-0.5 * (config.farthest / config.sigma) ** 2))
        self._field = np.maximum(self._plan.likelihood, floor)
        self._rng = np.random.default_rng(seed)
        spread = np.array([0.1, 0.1, np.deg2rad(3.0)])
        mean = np.array([start.position[0], start.position[1], start.yaw])
        self._particles = mean + spread * self._rng.standard_normal((config.most, 3))
        self._mean = mean
        self._odom = odom_from_base

    def due(self, odom_from_base: Pose) -> bool:
        """Return whether the robot came far enough for the next sweep to be used."""
        moved = self._odom.inverse() @ odom_from_base
        way = float(np.hypot(*moved.position[:2]))
        return way >= self.config.way or abs(moved.yaw) >= self.config.turn

    def add(self, sweep: Sweep, odom_from_base: Pose, level: Pose) -> Pose:
        """Take a sweep and return ``map_from_base`` in the plane.

        Args:
            sweep: deskewed points.
            odom_from_base: at its stamp.
            level: whose roll and pitch the robot has.
        """
        c = self.config
        moved = self._odom.inverse() @ odom_from_base
        if self.due(odom_from_base):
            self._odom = odom_from_base
            self._move(moved)
            points = level_points(sweep, level)
            if len(points) >= 10:
                self._weigh(points[np.linspace(0, len(points) - 1, c.beams).astype(int)])
            yaw = self._particles[:, 2]
            self._mean = np.array(
                [
                    *self._particles[:, :2].mean(axis=0),
                    np.arctan2(np.sin(yaw).mean(), np.cos(yaw).mean()),
                ]
            )
            moved = Pose.identity()
        return Pose.planar(*self._mean.tolist()) @ moved

    @property
    def spread(self) -> FloatArray:
        """Standard deviation of the particles (3,): x, y [m], yaw [rad]."""
        off = self._particles - self._mean
        off[:, 2] = np.mod(off[:, 2] + np.pi, 2.0 * np.pi) - np.pi
        found: FloatArray = np.sqrt((off**2).mean(axis=0))
        return found

    def _move(self, moved: Pose) -> None:
        a, n = self.config.motion_noise, len(self._particles)
        x, y = moved.position[:2]
        way = float(np.hypot(x, y))
        first = float(np.arctan2(y, x)) if way > 0.01 else 0.0
        # Driving backwards is no turn by 180 degrees.
        forward = abs(first) < np.pi / 2
        size = abs(first) if forward else np.pi - abs(first)
        second = wrap_angle(moved.yaw - first)
        size2 = min(abs(second), np.pi - abs(second))
        noise = self._rng.standard_normal((3, n))
        turn1 = first + noise[0] * np.sqrt(a * size**2 + a * way**2)
        drove = way + noise[1] * np.sqrt(a * way**2 + a * size**2 + a * size2**2)
        turn2 = second + noise[2] * np.sqrt(a * size2**2 + a * way**2)
        heading = self._particles[:, 2] + turn1
        self._particles = np.column_stack(
            [
                self._particles[:, 0] + drove * np.cos(heading),
                self._particles[:, 1] + drove * np.sin(heading),
                np.mod(heading + turn2 + np.pi, 2.0 * np.pi) - np.pi,
            ]
        )

    def _weigh(self, points: FloatArray) -> None:
        c, p = self.config, self._particles
        cos, sin = np.cos(p[:, 2:3]), np.sin(p[:, 2:3])
        x = p[:, 0:1] + cos * points[:, 0] - sin * points[:, 1]
        y = p[:, 1:2] + sin * points[:, 0] + cos * points[:, 1]
        origin, cell, shape = self._plan.origin, self._plan.cell, self._field.shape
        i = np.clip(((x - origin[0]) / cell).astype(np.int64), 0, shape[0] - 1)
        j = np.clip(((y - origin[1]) / cell).astype(np.int64), 0, shape[1] - 1)
        likelihood = c.hit * self._field[i, j] + c.random / c.range_max
        # As AMCL has it: beams are not independent, and a sum of cubes is gentler than a product.
        weight = 1.0 + (likelihood**3).sum(axis=1)
        self._draw(weight / weight.sum())

    def _draw(self, weight: FloatArray) -> None:
        """Draw particles until KLD sampling has enough."""
        c = self.config
        drawn = self._particles[self._rng.choice(len(weight), size=c.most, p=weight)]
        bins = np.floor(drawn / [c.bin, c.bin, c.bin_yaw]).astype(np.int64)
        _, first = np.unique(bins, axis=0, return_index=True)
        occupied = np.zeros(c.most)
        occupied[first] = 1.0
        k = np.maximum(np.cumsum(occupied), 2.0) - 1.0
        wanted = (
            k
            / (2.0 * c.error)
            * (1.0 - 2.0 / (9.0 * k) + np.sqrt(2.0 / (9.0 * k)) * c.quantile) ** 3
        )
        enough = np.flatnonzero(np.arange(1, c.most + 1) >= np.maximum(wanted, c.least))
        self._particles = drawn[: int(enough[0]) + 1 if enough.size else c.most]
