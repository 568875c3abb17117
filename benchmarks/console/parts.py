"""The console page in Debian's Chromium: opening, frames, clouds, stick, memory, bandwidth, and losing it.

Parts by name: opening rate frames cloud stick memory bandwidth clients hint xr losing; the last is also to be had in chunks,
losing-1 to losing-8. ``--minutes N`` is how long is driven for ``memory`` (5; the goal is of 30), ``--trials N`` how
often it is lost for ``losing`` (200 in all chunks). All is on loopback and
in real time, so other work on the machine shows. Without a graphics card Chromium draws on the processor, in a process of
its own that takes time from the robot and from the page.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from benchmarks.common.figures import Figure
from benchmarks.common.sheet import measure
from benchmarks.console.cloud import cloud
from benchmarks.console.frames import frames
from benchmarks.console.headset import xr
from benchmarks.console.hint import hint
from benchmarks.console.losing import CHUNKS, TRIALS, losing
from benchmarks.console.opening import opening
from benchmarks.console.rate import rate
from benchmarks.console.stick import clients, stick
from benchmarks.console.traffic import bandwidth, memory

TAKES_WORDS = True

PARTS: dict[str, Callable[..., Iterator[Figure]]] = {
    "opening": opening,
    "rate": rate,
    "frames": frames,
    "cloud": cloud,
    "stick": stick,
    "memory": memory,
    "bandwidth": bandwidth,
    "clients": clients,
    "hint": hint,
    "xr": xr,
    **{f"losing-{i + 1}": partial(losing, i) for i in range(CHUNKS)},
}
LOSING = "losing"
"""Stands for all its chunks."""


def main(words: Sequence[str] = (), *, out: Path | None = None) -> None:
    """Measure some parts, or all, and print their figures.

    Args:
        words: names of parts, and options.
        out: a sheet of figures; parts that are named take their places in it, the others stay.
    """
    parser = argparse.ArgumentParser(prog="python -m benchmarks console")
    named = (*(name for name in PARTS if not name.startswith(LOSING)), LOSING)
    parser.add_argument("parts", nargs="*", help=f"some of {', '.join(named)}")
    parser.add_argument("--minutes", type=int, default=5, help="of driving, for memory")
    parser.add_argument("--trials", type=int, default=TRIALS, help="of losing it")
    options = parser.parse_args(list(words))
    if options.minutes < 4 or options.trials < CHUNKS:
        parser.error(f"--minutes wants 4 or more, --trials {CHUNKS} or more")
    parts: dict[str, Callable[[], Iterator[Figure]]] = {
        **PARTS,
        "memory": partial(memory, minutes=options.minutes),
        **{f"{LOSING}-{i + 1}": partial(losing, i, options.trials) for i in range(CHUNKS)},
    }
    try:
        names = chosen(options.parts)
    except KeyError as unknown:
        parser.error(f"no part {unknown.args[0]}; there are {', '.join(named)}")
    measure({name: parts[name] for name in names}, out, whole=not options.parts)


def chosen(words: Sequence[str]) -> list[str]:
    """Return the parts that words name, all of them without words.

    Raises:
        KeyError: if there is no such part.
    """
    found = dict[str, None]()
    for word in words or PARTS:
        named = [name for name in PARTS if name == word or (word == LOSING and word in name)]
        if not named:
            raise KeyError(word)
        found.update(dict.fromkeys(named))
    return list(found)
