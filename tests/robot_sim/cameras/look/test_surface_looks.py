from __future__ import annotations

import numpy as np
import pytest

from robot_sim.cameras.look import surface_looks
from robot_sim.cameras.look.surface_looks import (
    LOOKS,
    TEXTURES,
    clothes,
    furniture_look,
    material_look,
)
from robot_sim.scene_objects.floor_surfaces import SURFACES
from robot_sim.scene_objects.furniture import FURNITURE, piece_blocks
from robot_sim.scene_objects.materials import MATERIALS
from robot_sim.scene_objects.plan_elements import Piece

SEAMLESS = (
    "carpet", "tile", "wet_tile", "concrete", "wet_concrete", "asphalt", "grass", "gravel", "planks", "ice",
    "brick", "leaves", "bark", "metal", "cladding", "render",
)  # fmt: skip


def test_every_material_and_surface_has_a_look() -> None:
    assert set(MATERIALS) <= set(LOOKS)
    assert set(SURFACES) <= set(LOOKS)
    assert {look.texture for look in LOOKS.values()} <= set(TEXTURES)


def test_every_part_of_the_catalogue_has_a_look() -> None:
    used = set()
    for kind in FURNITURE:
        for block in piece_blocks(Piece("p", kind, 0.0, 0.0)):
            used.add(furniture_look(kind, block.name.removeprefix("p_"), block.material, "p"))
    assert used <= set(LOOKS)
    rules = (*surface_looks._PARTS.values(), *surface_looks._VARIANTS.values())
    assert {look for looks in rules for look in looks} <= set(LOOKS)
    kinds = {rule.split("/")[0] for rule in surface_looks._PARTS}
    assert kinds <= set(FURNITURE)
    assert furniture_look("shelf", "back", "wood", "a") == "books"


def test_the_choice_among_looks_depends_on_the_name_alone() -> None:
    names = [f"person_{i}" for i in range(30)]

    assert [clothes(n) for n in names] == [clothes(n) for n in names]
    assert len({clothes(n) for n in names}) > 2
    assert material_look("no such material", "x") == "wall"


@pytest.mark.parametrize("name", TEXTURES)
def test_a_texture_is_small_and_always_the_same(name: str) -> None:
    image = TEXTURES[name]()

    assert image.dtype == np.uint8
    assert image.ndim == 3
    assert image.shape[2] == 3
    assert image.nbytes < 1_000_000
    np.testing.assert_array_equal(image, TEXTURES[name]())


@pytest.mark.parametrize("name", SEAMLESS)
def test_what_is_repeated_has_no_seam(name: str) -> None:
    image = TEXTURES[name]().astype(float)

    for axis in (0, 1):
        steps = np.abs(np.diff(image, axis=axis)).mean(axis=(1 - axis, 2))
        seam = np.abs(np.take(image, 0, axis) - np.take(image, -1, axis)).mean()
        # A joint between tiles is a step as well, so the seam is compared with the steepest step there is.
        assert seam <= 1.3 * steps.max()
