"""``python -m benchmarks [name [part ...] ...] [--out FOLDER]``: run the benchmarks, or those that are named.

A benchmark with ``PARTS`` runs the parts named after it, or all but its long ones. With ``--out`` those
that keep their figures put them into the folder's ``<name>.json`` and ``<name>.csv``, each part in the
place of what was there of it; ``python -m benchmarks._tables`` makes the tables of the docs from ``benchmarks/results``.
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
    words, out = sys.argv[1:], None
    if "--out" in words:
        at = words.index("--out")
        if at + 1 == len(words):
            print("--out wants a folder", file=sys.stderr)
            return 2
        out = Path(words[at + 1])
        del words[at : at + 2]
    chosen: dict[str, list[str]] = {} if words else {name: [] for name in known}
    modules: dict[str, ModuleType] = {}
    for word in words:
        if chosen and word in getattr(modules[last := list(chosen)[-1]], "PARTS", ()):
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
        kept = (
            {"out": out / f"{name}.json"}
            if out and "out" in signature(module.main).parameters
            else {}
        )
        module.main(*([parts] if parts else []), **kept)
    return 0


if __name__ == "__main__":
    sys.exit(main())
