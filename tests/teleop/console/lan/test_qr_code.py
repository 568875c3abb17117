"""QR codes in a terminal."""

from __future__ import annotations

import re

import pytest
import segno

from localization.extras import MissingLibraryError
from teleop.console.lan import qr_code
from teleop.console.lan.qr_code import qr_text

ADDRESS = f"https://192.168.1.7:9090/#token={'Ab-_' * 10}123"
BLOCKS = {"\u2588": (0, 0), "\u2580": (0, 1), "\u2584": (1, 0), " ": (1, 1)}
"""Dark modules (1) above and below in each character; the blocks are the light ones."""


def test_blocks_are_the_modules_of_the_address_with_a_quiet_zone() -> None:
    lines = qr_text(ADDRESS).split("\n")
    plain = [re.sub(r"\x1b\[[\d;]*m", "", line) for line in lines]
    drawn: list[list[int]] = []
    for line in plain:
        pairs = [BLOCKS[character] for character in line]
        drawn += [[above for above, _ in pairs], [below for _, below in pairs]]
    expected = [list(row) for row in segno.make_qr(ADDRESS, error="m").matrix_iter(border=2)]
    assert drawn[: len(expected)] == expected
    assert len(drawn) - len(expected) in (0, 1)


def test_code_fits_a_terminal_and_sets_both_colours_on_each_line() -> None:
    lines = qr_text(ADDRESS).split("\n")
    assert len(lines) <= 24
    assert all(line.startswith("\x1b[97;40m") and line.endswith("\x1b[0m") for line in lines)
    assert all(len(re.sub(r"\x1b\[[\d;]*m", "", line)) <= 80 for line in lines)


def test_missing_library_is_named_with_the_command_that_installs_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def missing(library: str, purpose: str) -> None:
        raise MissingLibraryError(f"{purpose} needs {library}")

    monkeypatch.setattr(qr_code, "require", missing)
    with pytest.raises(MissingLibraryError, match="--lan needs segno"):
        qr_text(ADDRESS)
