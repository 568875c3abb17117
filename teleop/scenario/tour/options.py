"""Options of a tour, and the scenario that they make of the shipped one, ``scenarios/tour.toml``.

The scenario's schema and the physics engine are imported when they are used, so that the command line can offer these
options without loading them.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Final

import tyro

from teleop.errors import SettingError
from teleop.robot.serving.robot_options import RobotOptions, check_slip_times

if TYPE_CHECKING:
    from robot_sim import World
    from teleop.scenario.files.scenario import Scenario

NAME: Final = "tour"
"""Name of the shipped scenario."""
_CUT: Final = 1.05
"""A tour must be this much longer than the distance to drive: the look-ahead cuts corners."""
_SHORT: Final = 0.8
"""Share of a shorter tour that must be driven: ends of blind alleys are passed at some distance."""


@dataclass(frozen=True, slots=True)
class TourOptions:
    """Everything that decides the outcome of a tour, so that the same options give the same bits."""

    scene: str = "office"
    """Scene to drive in: a name, or the path of a folder, a floor plan or an MJCF file."""
    seed: int = 0
    """Seed of all noise and of the direction of the hint's error; the same seed gives the same bits."""
    pose_error: float = 1.0
    """Distance of the hinted position from the true one [m]."""
    heading_error: float = 20.0
    """Difference of the hinted heading from the true one [degrees]."""
    hint_sigma: float = 0.5
    """Standard deviation of x and y that the hint claims [m]."""
    hint_sigma_heading: float = 10.0
    """Standard deviation of the heading that the hint claims [degrees]."""
    slip: Annotated[tuple[float, ...], tyro.conf.arg(metavar="S ...")] = ()
    """Times at which the wheels spin at twice their speed for a second [s]."""
    duration: float | None = None
    """Stop after this robot time [s]; unless given, the whole tour is driven."""
    robot: tyro.conf.OmitArgPrefixes[RobotOptions] = field(default_factory=RobotOptions)
    """Sensors and drive of the robot, and the state of its world."""

    def __post_init__(self) -> None:
        for name in ("pose_error", "heading_error", "hint_sigma", "hint_sigma_heading"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise SettingError(f"{name} must be finite and >= 0, got {value}")
        check_slip_times(self.slip)
        if self.duration is not None and not self.duration > 0.0:
            raise SettingError(f"duration must be > 0 s, got {self.duration}")
        if self.seed < 0:
            raise SettingError(f"seed must be >= 0, got {self.seed}")


def tour_scenario(options: TourOptions) -> tuple[Scenario, World]:
    """Return the scenario of a tour, and the world in which it is driven.

    Raises:
        SettingError: If an option says what no scenario can; the message names its field.
        SimulationError: If the world cannot be built.
    """
    from teleop.scenario.files.reading import scenario_from
    from teleop.scenario.files.shipped import shipped_files
    from teleop.scenario.session.scene import mapped_world
    from teleop.scenario.session.world_checks import check_settings

    data = tomllib.loads(shipped_files()[NAME].read_text(encoding="utf-8"))
    try:
        scenario = scenario_from(_changed(data, options))
    except ExceptionGroup as group:
        raise SettingError("; ".join(map(str, group.exceptions))) from None
    check_settings(scenario.world)
    world = mapped_world(scenario, None)
    if options.duration is None:
        data["limits"]["distance"] = least_distance(world, data["limits"]["distance"])
        scenario = scenario_from(data)
    return scenario, world


def _changed(data: dict[str, Any], options: TourOptions) -> dict[str, Any]:
    """Change the document of the shipped scenario as the options say, and return it."""
    data["seed"] = options.seed
    data["world"] = {"scene": options.scene, **asdict(options.robot)}
    data["operator"] |= {
        "off": options.pose_error,
        "turned": options.heading_error,
        "sigma": options.hint_sigma,
        "sigma_heading": options.hint_sigma_heading,
    }
    if options.duration is not None:
        data["mission"]["time_limit"] = options.duration
        data["limits"]["goals"] = False
        del data["limits"]["distance"]
    end = data["mission"]["time_limit"]
    data["fault"] = [{"kind": "wheel_slip", "at": at} for at in options.slip if at < end]
    return data


def least_distance(world: World, distance: float) -> float:
    """Return the distance to drive on a world's tour [m]: the given one, or less on a tour too short for it."""
    length = sum(math.dist(a, b) for a, b in pairwise(world.tour))
    return distance if length >= _CUT * distance else _SHORT * length
