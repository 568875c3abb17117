"""``python -m benchmarks guard FOLDER [SECONDS | wire | operators | cost] [--out FILE]``: drivers who mean to hit something.

Each drive is 120 s in one of ten worlds, of one driver and one seed, with the guard and without it, with physics and
scanners and without localiser or socket; one on each core. It appends a line to ``FOLDER/drives.jsonl``; those that are
there already are not driven again, so that a campaign goes on where it ended. ``wire`` has 2000 s driven by clients of
whole robots, ``cost`` takes the time, ``operators`` has the library's own drive over links of 0 to 1 s, likewise.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Final

from benchmarks.common.figures import Figure
from benchmarks.common.sheet import measure
from benchmarks.guard import cost, operators, physics, wire
from benchmarks.guard.drivers import DRIVERS
from benchmarks.guard.judge import DRIVE, Outcome, Plan
from benchmarks.guard.resumed import resumed
from benchmarks.guard.worlds import SCENES

TAKES_WORDS = True
WORLDS: Final = tuple(product(SCENES, (False, True)))
"""Each as it was mapped, and with its people and with furniture moved."""
ALL: Final = 100_000.0
"""Time to be driven [s]."""
WIRE: Final = 2000.0
"""Time of it to be driven over the wire [s]."""


def main(words: Sequence[str] = (), out: Path | None = None) -> int:
    """Drive what is missing, and print the sums."""
    folder = Path(words[0]) if words else Path()
    match words[1:]:
        case ["operators"]:
            measure({"operators": partial(operators.campaign, folder)}, out, whole=False)
        case ["cost"]:
            measure({"cost": cost.figures}, out, whole=False)
        case ["wire"]:
            measure({"wire": partial(_wire, folder)}, out, whole=False)
        case [] | [_] as rest if words and all(map(str.isdecimal, rest)):
            seconds = float(rest[0]) if rest else ALL
            measure({"campaign": partial(_campaign, folder, seconds)}, out, whole=False)
        case _:
            usage = "guard FOLDER [SECONDS | wire | operators | cost]: name a folder for the drives"
            print(f"{usage}, and what is driven: whole seconds of robot time", file=sys.stderr)
            return 2
    return 0


def _campaign(folder: Path, seconds: float) -> Iterator[Figure]:
    done = resumed(folder / "drives.jsonl", plan(seconds), physics.drive, Outcome)
    yield from _figures("adversarial drivers", done, ALL)


def _wire(folder: Path) -> Iterator[Figure]:
    done = resumed(folder / "wire.jsonl", plan(WIRE), wire.drive, Outcome)
    yield from _figures("over the wire", done, WIRE)


def plan(seconds: float) -> list[Plan]:
    """Return the drives of so many seconds with the guard, and of as many without it."""
    names = list(DRIVERS)
    return [
        Plan(*WORLDS[i % len(WORLDS)], names[i // len(WORLDS) % len(names)], i, guarded)
        for i in range(-(-round(seconds) // round(DRIVE)))
        for guarded in (True, False)
    ]


def _figures(case: str, done: Sequence[Outcome], seconds: float) -> Iterator[Figure]:
    for guarded in (True, False):
        mine = [o for o in done if o.guarded is guarded]
        method, n = f"{'with' if guarded else 'without'} guard", len(mine)
        none, all_of_it = (0.0, seconds) if guarded else (None, None)
        yield Figure(case, method, "driven", n * DRIVE, "s", n, least=all_of_it)
        yield Figure(case, method, "way", sum(o.way for o in mine), "m", n)
        seen = sum(o.seen for o in mine)
        yield Figure(case, method, "contacts with what is seen", seen, n=n, most=none)
        met = sum(o.met for o in mine)
        yield Figure(case, method, "contacts with people, robot moving", met, n=n, most=none)
        for quantity, count in (
            ("contacts with people, robot standing", sum(o.walked_into for o in mine)),
            ("contacts where a person pushed it", sum(o.pushed for o in mine)),
            ("contacts with lower and higher things", sum(o.unseen for o in mine)),
        ):
            yield Figure(case, method, quantity, count, n=n)
        names = sum((Counter(o.names) for o in mine), Counter[str]())
        print(method, ", ".join(f"{n} {name}" for name, n in names.most_common(8)) or "no contact")
