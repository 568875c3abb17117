"""Images of occupancy maps: large ones cost little memory, and cells near a threshold are counted."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from localization.maps.grid_image import FREE, OCCUPIED, UNKNOWN, Borderline, ImageRule, read_cells

SAVER = ImageRule("trinary", negate=False, low=0.196, high=0.65)
"""The thresholds that map_saver writes."""


def saved(folder: Path, pixels: np.ndarray) -> Path:
    path = folder / "image.png"
    Image.fromarray(pixels.astype(np.uint8)).save(path)
    return path


def test_grey_furniture_that_counts_as_free_floor_is_counted(tmp_path: Path) -> None:
    pixels = np.full((20, 30), 254)
    pixels[0], pixels[5:8, 5:10], pixels[10] = 0, 211, 205
    cells = read_cells(saved(tmp_path, pixels), SAVER)
    (near,) = cells.borderline()
    assert near == Borderline(15, "free", "free_thresh", 211, 1.0 - 211 / 255, 0.06)


def test_map_of_three_shades_has_no_cell_near_a_threshold(tmp_path: Path) -> None:
    pixels = np.array([[0, 205, 254]])
    cells = read_cells(saved(tmp_path, pixels), SAVER)
    assert cells.codes.tolist() == [[OCCUPIED, UNKNOWN, FREE]]
    assert cells.borderline() == ()


@pytest.mark.parametrize("low", [0.01, 0.02, 0.05])
def test_white_and_black_are_near_no_threshold_however_strict(low: float, tmp_path: Path) -> None:
    rule = replace(SAVER, low=low, high=1.0 - low)
    assert read_cells(saved(tmp_path, np.array([[0, 255, 205]])), rule).borderline() == ()


def test_greys_beside_a_strict_threshold_are_counted_and_map_savers_white_is_not(
    tmp_path: Path,
) -> None:
    rule = replace(SAVER, low=0.02)
    cells = read_cells(saved(tmp_path, np.array([[254, 254, 251]])), rule)
    (near,) = cells.borderline()
    assert (near.cells, near.kind, near.grey, near.within) == (1, "free", 251, 0.01)


def test_pale_walls_that_do_not_count_as_occupied_are_counted(tmp_path: Path) -> None:
    cells = read_cells(saved(tmp_path, np.array([[254, 92, 92]])), SAVER)
    (near,) = cells.borderline()
    assert (near.cells, near.kind, near.threshold) == (2, "unknown", "occupied_thresh")


def test_grey_and_coloured_image_give_the_same_cells(tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).integers(0, 256, size=(500, 400))
    grey = read_cells(saved(tmp_path, pixels), SAVER)
    coloured = read_cells(saved(tmp_path, np.stack([pixels] * 3, axis=2)), SAVER)
    assert (grey.codes == coloured.codes).all()
    assert (grey.counts == coloured.counts).all()
    assert grey.counts.sum() == pixels.size


def test_reading_takes_few_bytes_a_pixel(tmp_path: Path) -> None:
    path = saved(tmp_path, np.full((3000, 3000), 254))
    tracemalloc.start()
    read_cells(path, SAVER)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4 * 3000 * 3000
