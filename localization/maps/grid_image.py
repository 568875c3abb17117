"""Images of ROS occupancy maps: which pixel is an occupied, a free or an unknown cell.

Pixels are interpreted as by nav2's map_server: the darker a pixel, the more occupied its cell; thresholds, or
the pixel's own value in mode ``raw``, separate occupied, free and unknown cells. A map of 8000 x 8000 pixels
is usual, so that one byte is kept for each: whatever needs more is done for some rows at a time.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt
from PIL import Image, UnidentifiedImageError

from localization.geometry import FloatArray
from localization.maps.map_yaml import OccupancyError

Codes = npt.NDArray[np.uint8]
"""Array of the codes below."""
UNKNOWN: Final = 0
"""Code of a cell that is neither occupied nor free."""
FREE: Final = 1
"""Code of a free cell."""
OCCUPIED: Final = 2
"""Code of an occupied cell."""
NEAR: Final = 0.06
"""Distance in occupancy from a threshold within which a cell is borderline: 15 of 255 grey levels, chosen; but at
most half of what lies beyond the threshold, so that pure black and pure white never are."""
_STRIP: Final = 1 << 22
"""Number of pixels that are converted at a time."""
_KIND: Final = {UNKNOWN: "unknown", FREE: "free", OCCUPIED: "occupied"}


@dataclass(frozen=True, slots=True)
class Borderline:
    """Cells whose occupancy is close to a threshold."""

    cells: int
    """Number of these cells."""
    kind: str
    """What they count as: free, unknown or occupied."""
    threshold: str
    """Name of the entry whose threshold is near."""
    grey: int
    """Commonest value of their pixels, from 0 to 255; the mean of the channels in a coloured image."""
    occupancy: float
    """Occupancy of that value, which the threshold is compared with."""
    within: float
    """Distance from the threshold within which they all are."""


@dataclass(frozen=True, slots=True)
class ImageRule:
    """The entries of a ``map.yaml`` that say what a pixel is."""

    mode: str
    """``trinary``, ``scale`` or ``raw``."""
    negate: bool
    """Whether bright pixels are occupied."""
    low: float
    """``free_thresh``: occupancy below which a cell is free."""
    high: float
    """``occupied_thresh``: occupancy above which a cell is occupied."""

    def occupancy(self, shade: FloatArray) -> FloatArray:
        """Return the occupancy of pixels of a shade, both from 0 to 1; in mode raw it may exceed 1."""
        if self.mode == "raw":
            # The pixel's value is the occupancy in percent; values above 100 mean unknown.
            raw: FloatArray = np.round(255.0 * shade) / 100.0
            return raw
        return shade if self.negate else 1.0 - shade

    def codes(self, shade: FloatArray) -> Codes:
        """Return the codes of opaque pixels of a shade from 0 to 1."""
        codes = np.full(shade.shape, UNKNOWN, dtype=np.uint8)
        if self.mode == "raw":
            value = np.round(255.0 * shade)
            codes[value <= 100.0 * self.low] = FREE
            codes[(value >= 100.0 * self.high) & (value <= 100.0)] = OCCUPIED
            return codes
        occupancy = self.occupancy(shade)
        codes[occupancy < self.low] = FREE
        codes[occupancy > self.high] = OCCUPIED
        return codes


@dataclass(frozen=True, slots=True, eq=False)
class ImageCells:
    """The cells of an image."""

    codes: Codes
    """Code of each cell (rows, columns), the first row at the top of the image."""
    counts: npt.NDArray[np.int64]
    """Number of cells by code and by value of the pixel, (3, 256)."""
    rule: ImageRule
    """What made them so."""

    def borderline(self) -> tuple[Borderline, ...]:
        """Return the cells near a threshold for which that matters, the most numerous first.

        Cells that are unknown because they lie just above ``free_thresh`` are left out: map_saver writes
        all unknown cells like that.
        """
        occupancy = self.rule.occupancy(np.arange(256) / 255.0)
        found = []
        for name, at, codes in (
            ("free_thresh", self.rule.low, (FREE,)),
            ("occupied_thresh", self.rule.high, (FREE, UNKNOWN, OCCUPIED)),
        ):
            within = min(NEAR, 0.5 * at, 0.5 * (1.0 - at))
            near = np.abs(occupancy - at) <= within
            for code in codes:
                if n := int(self.counts[code, near].sum()):
                    grey = int(np.argmax(np.where(near, self.counts[code], -1)))
                    found.append(
                        Borderline(n, _KIND[code], name, grey, float(occupancy[grey]), within)
                    )
        return tuple(sorted(found, key=lambda b: -b.cells))


def read_cells(path: Path, rule: ImageRule) -> ImageCells:
    """Read an image and interpret its pixels.

    Raises:
        OccupancyError: If it is not an image, or cannot be read.
    """
    try:
        with Image.open(path) as image:
            if image.mode == "P":
                return _cells_of(image.convert("RGBA"), rule)
            if image.mode in ("1", "L"):
                return _grey_cells(np.asarray(image.convert("L")), rule)
            return _cells_of(image, rule)
    except UnidentifiedImageError:
        raise OccupancyError(f"image {str(path)!r} is not an image; use PGM or PNG") from None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise OccupancyError(f"image {str(path)!r} cannot be read: {reason}") from None


def _grey_cells(pixels: npt.NDArray[np.uint8], rule: ImageRule) -> ImageCells:
    table = rule.codes(np.arange(256) / 255.0)
    counts = np.zeros((3, 256), dtype=np.int64)
    for strip in np.array_split(pixels, 1 + pixels.size // _STRIP):
        # bincount takes eight bytes a pixel.
        counts[table, np.arange(256)] += np.bincount(strip.ravel(), minlength=256)
    return ImageCells(table[pixels], counts, rule)


def _cells_of(image: Image.Image, rule: ImageRule) -> ImageCells:
    """Return the cells of an image of any other kind, some rows at a time."""
    columns, rows = image.size
    codes = np.empty((rows, columns), dtype=np.uint8)
    counts = np.zeros((3, 256), dtype=np.int64)
    bands = image.getbands()
    lowest = image.getextrema()[-1][0] if bands[-1] == "A" else 255  # type: ignore[index]
    # In an opaque image the alpha channel would only brighten the mean.
    with_alpha = rule.mode == "trinary" and lowest < 255
    step = max(1, _STRIP // max(columns, 1))
    for row in range(0, rows, step):
        strip = image.crop((0, row, columns, min(row + step, rows)))
        if image.mode.startswith("I"):
            shade = np.asarray(strip, dtype=float) / 65535.0
            opaque = np.ones(shade.shape, dtype=bool)
        else:
            pixels = np.asarray(strip.convert("RGBA"))
            opaque = pixels[:, :, 3] == 255
            shade = pixels[:, :, : 4 if with_alpha else 3].mean(axis=2) / 255.0
        part = rule.codes(shade)
        if rule.mode == "scale":
            part[~opaque] = UNKNOWN
        codes[row : row + step] = part
        grey = np.clip(np.round(255.0 * shade), 0, 255).astype(np.int64)
        counts += np.bincount((256 * part.astype(np.int64) + grey).ravel(), minlength=768).reshape(
            3, 256
        )
    return ImageCells(codes, counts, rule)
