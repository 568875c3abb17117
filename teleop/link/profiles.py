"""Named links with sources, from the files in ``assets/links``."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field

from teleop.errors import SettingError
from teleop.link.recorded_trips import RecordedDelay, read_trips
from teleop.package_data import assets


@dataclass(frozen=True, slots=True)
class Profile:
    """The figures of a link; this one has none."""

    title: str = "no emulation"
    up: Mapping[str, float] = field(default_factory=dict)
    """Settings of ``Direction`` to the robot."""
    down: Mapping[str, float] = field(default_factory=dict)
    """The same from the robot."""
    up_trips: RecordedDelay | None = None
    down_trips: RecordedDelay | None = None


def profile_names() -> list[str]:
    """Return the names of all profiles."""
    return sorted(file.stem for file in (assets() / "links").glob("*.toml"))


def load_profile(name: str) -> Profile:
    """Return a profile by its name.

    Raises:
        SettingError: If there is none of that name.
    """
    if name not in profile_names():
        known = ", ".join(profile_names())
        raise SettingError(
            f"link: there is no profile {name!r}; there are {known}, and settings such as delay=0.3"
        )
    folder = assets() / "links"
    table = tomllib.loads((folder / f"{name}.toml").read_text(encoding="utf-8"))
    trips = read_trips(folder / table["trips"]) if "trips" in table else (None, None)
    return Profile(table["title"], table.get("up", {}), table.get("down", {}), *trips)
