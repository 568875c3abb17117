"""``python -m benchmarks [name [part ...] ...]``: run the benchmarks, or those that are named.

A benchmark with ``PARTS`` runs the parts named after it, or all.
"""

from __future__ import annotations

import datetime
import importlib
import pkgutil
import platform
import sys
from pathlib import Path
from types import ModuleType


def main() -> int:
    """Run each module's ``main``, which prints a table; say when and on what machine."""
    known = [m.name for m in pkgutil.iter_modules([str(Path(__file__).parent)]) if m.name[0] != "_"]
    chosen: dict[str, list[str]] = {} if sys.argv[1:] else {name: [] for name in known}
    modules: dict[str, ModuleType] = {}
    for word in sys.argv[1:]:
        if chosen and word in getattr(modules[last := list(chosen)[-1]], "PARTS", ()):
            chosen[last].append(word)
        elif word in known:
            chosen[word], modules[word] = [], importlib.import_module(f"benchmarks.{word}")
        else:
            there = ", ".join(known)
            print(f"no benchmark or part {word}; the benchmarks are {there}", file=sys.stderr)
            return 2
    processor = next(
        (
            line.partition(":")[2].strip()
            for line in Path("/proc/cpuinfo").read_text().splitlines()
            if line.startswith("model name")
        ),
        platform.machine(),
    )
    print(f"{datetime.datetime.now():%Y-%m-%d}, {processor}, Python {platform.python_version()}")
    for name, parts in chosen.items():
        module = importlib.import_module(f"benchmarks.{name}")
        print(f"\n{name}: {(module.__doc__ or '').partition(chr(10))[0]}", flush=True)
        module.main(*([parts] if parts else []))
    return 0


if __name__ == "__main__":
    sys.exit(main())
