"""How each kind of surface looks: its texture, how large that is, and how it shines.

A look is found by what a solid is (a shelf's back, a rack's beam) or else by its material's name.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

from robot_sim.cameras.look.ground_textures import GROUNDS
from robot_sim.cameras.look.object_textures import OBJECTS
from robot_sim.cameras.look.pattern_noise import Image

TEXTURES: Final[Mapping[str, Callable[[], Image]]] = {**GROUNDS, **OBJECTS}
"""Makers of all textures by name."""


@cache
def texture(name: str) -> Image:
    """Return a texture; each is made once in a process."""
    return TEXTURES[name]()


@dataclass(frozen=True, slots=True)
class Look:
    """Appearance of a surface."""

    texture: str
    """Name of the texture."""
    size: float = 0.0
    """Length of the texture's side on the surface [m]; 0 to fit it to each face."""
    specular: float = 0.0
    """Strength of the highlight, 0 to 1."""
    shininess: float = 0.2
    """Sharpness of the highlight, 0 to 1."""
    emission: float = 0.0
    """Light of its own, 0 to 1."""
    alpha: float = 1.0
    """Opacity."""


LOOKS: Final[Mapping[str, Look]] = {
    # Materials.
    "wall": Look("plaster", 4.0),
    "wood": Look("wood", 1.2, specular=0.15),
    "metal": Look("metal", 1.0, specular=0.4, shininess=0.5),
    "fabric": Look("fabric_blue", 0.06),
    "dark_fabric": Look("fabric_dark", 0.06),
    "rubber": Look("rubber", 0.3),
    "leaves": Look("leaves", 0.9),
    "bark": Look("bark", 0.7),
    "concrete": Look("concrete", 2.5),
    "wet_concrete": Look("wet_concrete", 2.5, specular=0.3, shininess=0.6),
    "brick": Look("brick", 1.0),
    "asphalt": Look("asphalt", 1.5),
    "grass": Look("grass", 1.6),
    "wet_grass": Look("grass", 1.6, specular=0.1),
    "gravel": Look("gravel", 0.8),
    "tile": Look("tile", 1.6, specular=0.15, shininess=0.6),
    "wet_tile": Look("wet_tile", 1.2, specular=0.3, shininess=0.7),
    "carpet": Look("carpet", 1.0),
    "ice": Look("ice", 3.0, specular=0.4, shininess=0.8),
    "cardboard": Look("carton"),
    "plastic": Look("plastic", 0.8, specular=0.3, shininess=0.4),
    "glass": Look("glass", 0.0, specular=0.4, shininess=0.8, alpha=0.12, emission=0.4),
    "mirror": Look("glass", 0.0, specular=0.8, shininess=0.9),
    "skin": Look("skin", 0.5),
    "retroreflector": Look("yellow", 0.5, specular=0.6),
    # Parts of buildings.
    "ceiling": Look("ceiling", 2.4, emission=0.25),
    "render": Look("render", 2.0),
    "cladding": Look("cladding", 2.0, specular=0.15),
    "window": Look("window", specular=0.4, shininess=0.8, emission=0.15),
    "steel_roof": Look("steel_roof", 5.0, emission=0.2),
    "wood_floor": Look("planks", 1.2, specular=0.1),
    "door": Look("door", specular=0.1),
    "shutter": Look("shutter", 1.0, specular=0.2),
    # Furniture.
    "books": Look("books"),
    "dark_wood": Look("dark_wood", 1.2, specular=0.15),
    "pale_wood": Look("pale_wood", 1.2, specular=0.15),
    "drawers": Look("drawers", specular=0.2),
    "white": Look("white", 1.0, specular=0.2),
    "terracotta": Look("terracotta", 0.5),
    # Industry.
    "goods": Look("goods"),
    "orange": Look("orange", 0.8, specular=0.2),
    "blue": Look("blue", 0.8, specular=0.2),
    "red": Look("red", 0.8, specular=0.2),
    "yellow": Look("yellow", 0.8, specular=0.2),
    "machine": Look("machine", specular=0.2),
    # Variants.
    "fabric_red": Look("fabric_red", 0.06),
    "fabric_green": Look("fabric_green", 0.06),
    "fabric_grey": Look("fabric_grey", 0.06),
    "pale_cardboard": Look("pale_carton"),
}
"""Looks by name; the materials of the simulation are among them."""

_PARTS: Final[Mapping[str, tuple[str, ...]]] = {
    "shelf/back": ("books",),
    "shelf/side": ("pale_wood",),
    "shelf/board": ("pale_wood",),
    "desk/top": ("pale_wood", "pale_wood", "wood"),
    "cabinet/body": ("drawers",),
    "pillar/": ("render",),
    "round_pillar/": ("render",),
    "counter/body": ("white",),
    "plant/pot": ("terracotta", "white"),
    "sofa/": ("fabric_grey", "fabric_red", "fabric"),
    "chair/seat": ("fabric_grey", "fabric", "fabric_grey"),
    "chair/back": ("fabric_grey", "fabric", "fabric_grey"),
    "rack/upright": ("blue",),
    "rack/beam": ("orange",),
    "pallet/load": ("goods",),
    "dock_door/leaf": ("shutter",),
    "forklift/body": ("yellow", "orange"),
    "guard_rail/": ("yellow",),
    "drum/body": ("blue", "plastic", "red"),
    "machine/body": ("machine",),
    "tank/body": ("white",),
    "heating/": ("white",),
    "bench/seat": ("dark_wood",),
    "bench/back": ("dark_wood",),
}
"""Looks of a piece of furniture by its kind and the beginning of the part's name; several take turns."""
_VARIANTS: Final[Mapping[str, tuple[str, ...]]] = {
    "cardboard": ("cardboard", "cardboard", "pale_cardboard"),
}
_CLOTHES: Final = ("fabric", "fabric_red", "fabric_green", "fabric_grey")


def furniture_look(kind: str, part: str, material: str, name: str) -> str:
    """Return the look of a part of a piece of furniture.

    Args:
        kind: Kind of the piece, a key of the catalogue.
        part: Name of the part.
        material: Its material.
        name: Name of the piece, by which one of several looks is chosen.
    """
    if kind == "rack" and part.endswith("_load"):
        return pick(("goods", "goods", "cardboard", "pale_cardboard"), f"{name}_{part}")
    for beginning, looks in _PARTS.items():
        if f"{kind}/{part}".startswith(beginning):
            return pick(looks, name)
    return material_look(material, name)


def material_look(material: str, name: str) -> str:
    """Return the look of a material; solids of a plain wall's for any name that is not known."""
    if material in _VARIANTS:
        return pick(_VARIANTS[material], name)
    return material if material in LOOKS else "wall"


def clothes(name: str) -> str:
    """Return the look of a person's clothes."""
    return pick(_CLOTHES, name)


def pick(looks: tuple[str, ...], name: str) -> str:
    """Return one of several looks, always the same for a name."""
    return looks[zlib.crc32(name.encode()) % len(looks)]
