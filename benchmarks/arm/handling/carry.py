"""A box in the gripper over ten metres and three turns, driven over the wire as the scenario ``arm-carries-a-box`` is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from benchmarks.common.figures import Figure, share
from benchmarks.common.progress import with_progress
from teleop.scenario.files.reading import read_scenario
from teleop.scenario.files.shipped import shipped_files
from teleop.scenario.session.run import run_scenario

MASSES = (0.01, 0.02, 0.03, 0.04)
"""Masses of the box [kg]."""
TURNED = (-15.0, 0.0, 15.0)
"""Yaws of the box against the gripper [degrees]."""


def carry() -> Iterator[Figure]:
    """Yield how far the box slips in the gripper, and whether it is lost."""
    scenario = read_scenario(shipped_files()["arm-carries-a-box"])
    (box,) = scenario.world.parcels
    kinds = [(mass, yaw) for mass in MASSES for yaw in TURNED]
    figures = []
    for mass, yaw in with_progress(kinds, len(kinds), "carried boxes"):
        parcel = replace(box, at=(*box.at[:2], yaw), mass=mass)
        world = replace(scenario.world, parcels=(parcel,))
        figures.append(run_scenario(replace(scenario, world=world)).figures)
    case, method, n = "box of 30 mm, 10 to 40 g", "carried over the wire", len(figures)
    kept = sum(f["picked"] == 1.0 and f["dropped"] == 0.0 for f in figures)
    yield share(case, method, "not lost", kept, n, least=100.0)
    yield Figure(
        case, method, "slip, most", 1e3 * max(f["slip"] for f in figures), "mm", n, most=10.0
    )
    yield Figure(
        case, method, "way, least", min(f["distance"] for f in figures), "m", n, least=10.0
    )
