"""Named links with sources, from the files in ``assets/links``."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path

from teleop.errors import SettingError
from teleop.package_data import assets

Figures = Mapping[str, float]
"""Settings of one ``Direction``."""


def profile_names() -> list[str]:
    """Return the names of all profiles."""
    return sorted(file.stem for file in (assets() / "links").glob("*.toml"))


def load_profile(name: str) -> tuple[Figures, Figures, Path | None]:
    """Return a profile's figures to the robot and from it, and the file of its recorded round trips, if it has one.

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
    trips = folder / table["trips"] if "trips" in table else None
    return table.get("up", {}), table.get("down", {}), trips
