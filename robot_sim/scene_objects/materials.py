"""Optical materials at 905 nm: how much light of a scanner they scatter, reflect and transmit.

A geom's material is found by the *name* of its MuJoCo material. Names that are not in ``MATERIALS``, and
geoms without a material, count as the default matt wall. Reflectivity is relative to a matt white
standard (SICK's remission): 1.0 scatters like the standard, a retroreflector far more. (M) marks
figures quoted from memory and not checked.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

_VENDOR: Final = "remission table in SICK's LMS2xx technical description (M)"
_CHOSEN: Final = "chosen between neighbours of that table; no measurement of our own"
_SPECTRA: Final = (
    "near-infrared plateau of published spectra, as in the ECOSTRESS library, rounded (M)"
)


@dataclass(frozen=True, slots=True)
class Material:
    """One kind of surface as seen by a pulsed laser at 905 nm."""

    name: str
    """Name of the material."""
    reflectivity: float
    """Diffuse part at normal incidence, relative to a matt white standard; > 1 for retroreflectors."""
    source: str
    """Source of the figures."""
    transmittance: float = 0.0
    """Share of the light that a pane transmits at normal incidence, both faces counted."""
    specular: float = 0.0
    """Share that is reflected specularly at normal incidence."""
    refractive_index: float = 1.0
    """Refractive index of a clear pane; 1 for opaque materials."""

    def __post_init__(self) -> None:
        for field in ("reflectivity", "transmittance", "specular"):
            if not 0.0 <= getattr(self, field) < float("inf"):
                raise ValueError(
                    f"material {self.name!r}: {field} must be >= 0, got {getattr(self, field)}"
                )
        if self.transmittance + self.specular > 1.0:
            raise ValueError(
                f"material {self.name!r}: transmittance + specular must be <= 1, got"
                f" {self.transmittance + self.specular:g}"
            )
        if self.refractive_index < 1.0:
            raise ValueError(
                f"material {self.name!r}: refractive_index must be >= 1, got {self.refractive_index}"
            )

    @property
    def clear(self) -> bool:
        """Whether light is followed through the surface or off it."""
        return self.transmittance > 0.0 or self.specular > 0.0


_CATALOGUE: Final = (
    Material("wall", 0.80, f"matt white paint, as white paper; {_VENDOR}"),
    Material("wood", 0.40, f"raw pine, dirty; {_VENDOR}"),
    Material("metal", 1.10, f"anodised or painted sheet, scattering; {_VENDOR}"),
    Material("fabric", 0.60, f"dyes are pale in the near infrared; {_CHOSEN}"),
    Material("dark_fabric", 0.10, f"as matt black cardboard; {_VENDOR}"),
    Material(
        "rubber", 0.024, "black foam rubber, 2.4 %; SICK, LMS5xx operating instructions 8013796"
    ),
    Material("leaves", 0.50, f"green leaves; {_SPECTRA}"),
    Material("bark", 0.30, _SPECTRA),
    Material("concrete", 0.35, _SPECTRA),
    Material("brick", 0.40, _SPECTRA),
    Material("asphalt", 0.15, f"worn; {_SPECTRA}"),
    Material("grass", 0.45, f"green; {_SPECTRA}"),
    Material("gravel", 0.30, _SPECTRA),
    Material("tile", 0.60, f"glazed, light; {_CHOSEN}"),
    Material("carpet", 0.30, _CHOSEN),
    Material("cardboard", 0.50, f"brown; {_CHOSEN}"),
    Material("plastic", 0.50, f"grey PVC; {_VENDOR}"),
    Material(
        "glass",
        0.001,
        "6 mm float: two Fresnel faces of index 1.52 (8 % mirrored) and some 10 % absorbed by iron;"
        " 0.1 % diffuse, for clean glass, is chosen",
        transmittance=0.82,
        specular=0.08,
        refractive_index=1.52,
    ),
    Material(
        "mirror",
        0.001,
        "silvered glass: silver mirrors 97 % at 905 nm, its glass costs some; 0.1 % diffuse is chosen",
        specular=0.85,
    ),
    Material("skin", 0.55, f"near-infrared window of skin; {_SPECTRA}"),
    Material("retroreflector", 20.0, f"reflective foil, > 2000 %; {_VENDOR}"),
)

MATERIALS: Final = {material.name: material for material in _CATALOGUE}
"""Materials by the name of the MuJoCo material."""

DEFAULT: Final = MATERIALS["wall"]
"""Material of geoms without a known material."""


def material_named(name: str) -> Material:
    """Return the material of a MuJoCo material's name; the default wall for any other name."""
    return MATERIALS.get(name, DEFAULT)
