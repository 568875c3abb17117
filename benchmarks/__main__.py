"""``python -m benchmarks [name ...]``: run the benchmarks, or those that are named."""

from __future__ import annotations

import datetime
import importlib
import pkgutil
import platform
import sys
from pathlib import Path


def main() -> int:
    """Run each module's ``main``, which prints a table; say when and on what machine."""
    known = [m.name for m in pkgutil.iter_modules([str(Path(__file__).parent)]) if m.name[0] != "_"]
    chosen = sys.argv[1:] or known
    if unknown := sorted(set(chosen) - set(known)):
        print(f"no benchmark {', '.join(unknown)}; there are {', '.join(known)}", file=sys.stderr)
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
    for name in chosen:
        module = importlib.import_module(f"benchmarks.{name}")
        print(f"\n{name}: {(module.__doc__ or '').partition(chr(10))[0]}")
        module.main()
    return 0


if __name__ == "__main__":
    sys.exit(main())
