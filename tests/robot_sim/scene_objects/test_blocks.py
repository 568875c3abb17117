"""Walls and furniture as solids."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Door, Piece, Wall, Window
from robot_sim.scene_objects.blocks import Block, box
from robot_sim.scene_objects.furniture import FURNITURE, piece_blocks
from robot_sim.scene_objects.walls import wall_blocks

WALL = Wall("w", (1.0, 0.0), (1.0, 6.0), height=2.8, thickness=0.1)


def span(block: Block) -> tuple[str, float, float, float, float]:
    """Name, then from and to along y, then from and to in height."""
    return (
        block.name,
        round(block.y - block.half[0], 6),
        round(block.y + block.half[0], 6),
        round(block.z - block.half[2], 6),
        round(block.z + block.half[2], 6),
    )


def test_wall_is_split_at_its_doors_and_closed_above_them() -> None:
    pieces = wall_blocks(replace(WALL, doors=(Door(2.0, 1.0),)))
    assert [span(p) for p in pieces] == [
        ("w_0", 0.0, 1.5, 0.0, 2.8),
        ("w_1", 2.5, 6.0, 0.0, 2.8),
        ("w_lintel_0", 1.5, 2.5, 2.05, 2.8),
    ]


def test_window_is_glass_between_sill_and_lintel() -> None:
    pieces = list(wall_blocks(replace(WALL, windows=(Window(3.0, 2.0, 0.9, 1.5),))))
    assert [span(p) for p in pieces] == [
        ("w_0", 0.0, 2.0, 0.0, 2.8),
        ("w_1", 4.0, 6.0, 0.0, 2.8),
        ("w_sill_0", 2.0, 4.0, 0.0, 0.9),
        ("w_over_0", 2.0, 4.0, 2.4, 2.8),
        ("w_pane_0", 2.0, 4.0, 0.9, 2.4),
    ]
    assert [p.material for p in pieces] == ["wall"] * 4 + ["glass"]


@pytest.mark.parametrize(
    ("wall", "message"),
    [
        (replace(WALL, doors=(Door(5.8, 1.0),)), "the door at 5.8 m does not fit into it"),
        (replace(WALL, doors=(Door(2.0, 1.0), Door(2.9, 1.0))), "the door at 2.9 m does not fit"),
        (replace(WALL, windows=(Window(2.0, 1.0, 2.0, 1.0),)), "reaches from 2 m to 3 m"),
    ],
)
def test_opening_that_does_not_fit_is_rejected(wall: Wall, message: str) -> None:
    with pytest.raises(WorldError, match=message):
        list(wall_blocks(wall))


@pytest.mark.parametrize("kind", FURNITURE)
def test_furniture_keeps_within_its_size_and_stands_on_the_floor(kind: str) -> None:
    width, depth, height = FURNITURE[kind].size
    parts = list(piece_blocks(Piece("it", kind, 0.0, 0.0)))
    assert len({p.name for p in parts}) == len(parts)
    for part in parts:
        assert abs(part.x) + part.half[0] <= 0.5 * width + 1e-9
        assert abs(part.y) + part.half[1] <= 0.5 * depth + 1e-9
        assert -1e-9 <= part.z - part.half[2] <= part.z + part.half[2] <= height + 1e-9


def test_furniture_turns_about_its_place() -> None:
    (body,) = piece_blocks(Piece("it", "box", 3.0, 4.0, math.pi / 2))
    assert (body.x, body.y, body.yaw) == pytest.approx((3.0, 4.0, math.pi / 2))


def test_object_on_a_hill_is_as_solid_as_on_the_floor() -> None:
    parts = list(piece_blocks(Piece("it", "desk", 0.0, 0.0), ground=5.0))
    assert [p.solid for p in parts] == [
        p.solid for p in piece_blocks(Piece("it", "desk", 0.0, 0.0))
    ]
    assert min(p.bottom for p in parts) == pytest.approx(5.0)


def test_object_above_the_robot_is_visible_but_not_solid() -> None:
    assert box("low", 0.0, 0.0, 0.59, 2.0, (1.0, 1.0)).solid
    assert not box("high", 0.0, 0.0, 0.61, 2.0, (1.0, 1.0)).solid


def test_bottom_of_a_tilted_block_is_its_lower_edge() -> None:
    tilted = replace(box("ramp", 0.0, 0.0, -0.1, 0.1, (2.0, 1.0)), pitch=math.pi / 6)
    assert tilted.bottom == pytest.approx(-0.5 - 0.1 * math.cos(math.pi / 6))


def test_every_kind_is_on_the_page_of_worlds() -> None:
    page = (Path(__file__).parents[3] / "docs/sheets/catalogues.md").read_text(encoding="utf-8")
    for kind, entry in FURNITURE.items():
        size = " \N{MULTIPLICATION SIGN} ".join(f"{v:g}" for v in entry.size)
        assert f"| `{kind}` | {size} |" in page, kind
