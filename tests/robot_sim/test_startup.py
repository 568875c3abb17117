"""Libraries that a program with the simulation alone has to load."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

HEAVY = {"scipy", "kiss_icp", "filterpy", "rosbags", "pydantic", "open3d", "matplotlib", "rerun"}
"""Each of these takes as long to import as the office takes to build."""


@pytest.mark.process
def test_simulation_starts_without_the_localisers_libraries() -> None:
    program = (
        "import sys; from robot_sim import Simulation; Simulation('office').step();"
        "print(*{name.partition('.')[0] for name in sys.modules})"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert not HEAVY & set(done.stdout.split())
    assert done.stderr == ""


def test_localisers_names_are_imported_on_demand() -> None:
    import localization

    homes = localization._HOMES
    assert localization.Localizer.__module__ == "localization.pipeline.localizer"
    for home, names in homes.items():
        for name in names:
            loaded = getattr(localization, name)
            assert loaded is getattr(importlib.import_module(f"localization.{home}"), name)
    with pytest.raises(AttributeError, match="Localiser"):
        localization.Localiser  # noqa: B018
