"""Report of the validation: as text, as Markdown tables, and as one line with the verdict."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from textwrap import wrap
from typing import Final

from robot_sim.errors import PageError
from robot_sim.scene_objects.floor_surfaces import SURFACES
from robot_sim.validation.row import Row

HEADINGS: Final = ("what", "target", "tolerance", "value", "result", "source of the target")


def plain(rows: Iterable[Row]) -> str:
    """Return the rows as lines of text under their headings, two or more for each row, in 80 columns."""
    lines: list[str] = []
    for group, members in groupby(rows, key=lambda row: row.group):
        lines += ["", group]
        for row in members:
            name, target, tolerance, value, result, source = row.cells
            figures = f"{value}, target {target} {tolerance}, {result}"
            lines += wrap(name, 80, initial_indent="  ", subsequent_indent="  ")
            lines += wrap(figures, 80, initial_indent=" " * 6, subsequent_indent=" " * 6)
            lines += wrap(f"({source})", 80, initial_indent=" " * 6, subsequent_indent=" " * 6)
    return "\n".join(lines).lstrip("\n")


def verdict(rows: Sequence[Row]) -> str:
    """Return one line on how many rows are met; rows without a tolerance are counted apart."""
    judged = [row for row in rows if row.judged]
    missed = [row.name for row in rows if not row.passed]
    if missed:
        return f"{len(missed)} of {len(judged)} judged rows missed: {'; '.join(missed)}"
    fitted = sum(row.fitted for row in judged)
    only_reported = len(rows) - len(judged)
    return f"{len(judged)} judged rows met, of which {fitted} fitted; {only_reported} reported only"


def markdown_table(rows: Iterable[Row]) -> str:
    """Return the rows as a Markdown table for each group."""
    lines: list[str] = []
    for group, members in groupby(rows, key=lambda row: row.group):
        lines += [f"### {group}", "", *_grid(HEADINGS, (row.cells for row in members)), ""]
    return "\n".join(lines)


def surfaces() -> str:
    """Return the table of floor surfaces as Markdown."""
    headings = ("surface", "mu along", "mu across", "rolling resistance", "source")
    cells = (
        (s.name, f"{s.mu_long:.2f}", f"{s.mu_lat:.2f}", f"{s.rolling_resistance:.3f}", s.source)
        for s in SURFACES.values()
    )
    return "\n".join((*_grid(headings, cells), ""))


def _grid(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(headings)} |"
    yield "|" + "---|" * len(headings)
    for row in rows:
        yield f"| {' | '.join(row)} |"


def page_with_tables(page: str, rows: Sequence[Row]) -> str:
    """Return a page's text with both of its tables replaced.

    Raises:
        PageError: a pair of marker comments is missing.
    """
    return _replaced(_replaced(page, "validation", markdown_table(rows)), "surfaces", surfaces())


def write_report(path: Path, rows: Sequence[Row]) -> None:
    """Replace both tables of a page in its file.

    Raises:
        PageError: a pair of marker comments is missing.
        OSError: the file cannot be read or written.
    """
    try:
        page = path.read_text(encoding="utf-8")
        path.write_text(page_with_tables(page, rows), encoding="utf-8")
    except PageError as error:
        raise PageError(f"{path}: {error}") from None


def _replaced(page: str, name: str, text: str) -> str:
    start, end = _marks(page, name)
    return f"{page[:start]}\n\n{text.strip()}\n\n{page[end:]}"


def _marks(page: str, name: str) -> tuple[int, int]:
    """Return where the text between the markers begins and ends."""
    begin, finish = f"<!-- {name} begin -->", f"<!-- {name} end -->"
    if page.count(begin) != 1 or page.count(finish) != 1 or page.index(finish) < page.index(begin):
        raise PageError(f"the page needs one {begin} and after it one {finish}")
    return page.index(begin) + len(begin), page.index(finish)
