"""The catalogue of surfaces."""

from __future__ import annotations

from pathlib import Path

import pytest

from robot_sim.scene_objects.blocks import COLORS
from robot_sim.scene_objects.materials import DEFAULT, MATERIALS, Material, material_named


def test_every_material_has_a_colour_and_a_source() -> None:
    assert set(COLORS) == set(MATERIALS)
    assert all(material.source for material in MATERIALS.values())
    assert all(name == material.name for name, material in MATERIALS.items())


def test_unknown_names_count_as_the_matt_wall() -> None:
    assert material_named("") is DEFAULT
    assert material_named("unobtainium") is DEFAULT
    assert material_named("rubber").reflectivity < 0.1 < material_named("wall").reflectivity


def test_only_glass_and_mirror_are_clear() -> None:
    assert {m.name for m in MATERIALS.values() if m.clear} == {"glass", "mirror"}


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"reflectivity": -0.1}, "reflectivity"),
        ({"reflectivity": float("nan")}, "reflectivity"),
        ({"transmittance": 0.8, "specular": 0.3}, r"transmittance \+ specular"),
        ({"refractive_index": 0.9}, "refractive_index"),
    ],
)
def test_invalid_material_is_rejected_by_its_field(change: dict[str, float], named: str) -> None:
    numbers = {"reflectivity": 0.5} | change
    with pytest.raises(ValueError, match=named):
        Material("odd", source="none", **numbers)


def test_documentation_lists_each_materials_remission() -> None:
    page = (Path(__file__).parents[3] / "docs/sheets/catalogues.md").read_text(encoding="utf-8")
    for material in MATERIALS.values():
        assert f"| `{material.name}` | {100.0 * material.reflectivity:g} |" in page
