"""What surfaces do with a scanner's light at 905 nm: scatter it, mirror it, or let it through.

A geom's material is its MuJoCo material's *name*. Names that are not in ``MATERIALS``, and geoms
without a material, count as the default matt wall. Reflectivity is told against a matt white
standard (what SICK calls remission): 1.0 scatters like the standard, a retroreflector far more. (M)
marks what was quoted from memory and not read again.
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
    """One kind of surface as a pulsed laser at 905 nm meets it."""

    name: str
    reflectivity: float
    """Diffuse part at normal incidence against a matt white standard; > 1 sends light back."""
    source: str
    """Where the figures come from."""
    transmittance: float = 0.0
    """Share of the light that a pane passes at normal incidence, both faces counted."""
    specular: float = 0.0
    """Share that is mirrored at normal incidence."""
    refractive_index: float = 1.0
    """Of a clear pane; 1 for everything that is opaque."""

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
        """Whether a scanner looks through it, or into it."""
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
"""By the name of the MuJoCo material."""

DEFAULT: Final = MATERIALS["wall"]
"""What geoms of no or another material count as."""


def material_named(name: str) -> Material:
    """Return the material of that MuJoCo material name; the default wall for any other name."""
    return MATERIALS.get(name, DEFAULT)
