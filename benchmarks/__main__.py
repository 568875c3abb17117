"""``python -m benchmarks [name [part ...] ...] [--out FOLDER]``: run the benchmarks, or those that are named.

``--real FOLDER`` and ``--mirror FOLDER`` name data that are no part of the repository, for those that use them.

A benchmark with ``TAKES_WORDS`` takes all words after its name as its own arguments, such as ``real FOLDER``.
One with ``PARTS`` runs the parts named after it, or all but its long ones. With ``--out`` those
that keep their figures put them into the folder's ``<name>.json`` and ``<name>.csv``, each part in the
place of what was there of it; ``python -m benchmarks._tables`` writes the sheets of the docs from ``benchmarks/results``.
"""

from __future__ import annotations

import datetime
import importlib
import pkgutil
import platform
import sys
from inspect import signature
from pathlib import Path
from types import ModuleType

from benchmarks._figures import processor


def main() -> int:
    """Run each module's ``main``, which prints a table; say when and on what machine."""
    known = [m.name for m in pkgutil.iter_modules([str(Path(__file__).parent)]) if m.name[0] != "_"]
    words, folders = sys.argv[1:], dict[str, Path]()
    for option in ("out", "real", "mirror"):
        if f"--{option}" in words:
            at = words.index(f"--{option}")
            if at + 1 == len(words):
                print(f"--{option} requires a folder", file=sys.stderr)
                return 2
            folders[option] = Path(words[at + 1])
            del words[at : at + 2]
    chosen: dict[str, list[str]] = {} if words else {name: [] for name in known}
    modules: dict[str, ModuleType] = {}
    for word in words:
        last = list(chosen)[-1] if chosen else ""
        if last and (_takes_words(modules[last]) or word in getattr(modules[last], "PARTS", ())):
            chosen[last].append(word)
        elif word in known:
            chosen[word], modules[word] = [], importlib.import_module(f"benchmarks.{word}")
        else:
            there = ", ".join(known)
            print(f"no benchmark or part {word}; the benchmarks are {there}", file=sys.stderr)
            return 2
    print(f"{datetime.datetime.now():%Y-%m-%d}, {processor()}, Python {platform.python_version()}")
    for name, parts in chosen.items():
        module = importlib.import_module(f"benchmarks.{name}")
        print(f"\n{name}: {(module.__doc__ or '').partition(chr(10))[0]}", flush=True)
        taken = signature(module.main).parameters
        given = {option: folder for option, folder in folders.items() if option in taken}
        if "out" in given:
            given["out"] /= f"{name}.json"
        module.main(*([parts] if parts else []), **given)
    return 0


def _takes_words(module: ModuleType) -> bool:
    """Return whether all words after a benchmark's name are its own arguments."""
    return bool(getattr(module, "TAKES_WORDS", False))


if __name__ == "__main__":
    sys.exit(main())
