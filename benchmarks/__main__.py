"""``python -m benchmarks [name [part ...] ...] [--out FOLDER]``: run the benchmarks, or those that are named.

``--real FOLDER`` and ``--mirror FOLDER`` name data that are no part of the repository, for those that use them.

A benchmark with ``TAKES_WORDS`` takes all words after its name as its own arguments, such as ``real FOLDER``.
One with ``PARTS`` runs the parts named after it, or all but its long ones. With ``--out`` those that keep
their figures put them into the folder's ``<name>.json``: a part that is named takes the place of what was there
of it, and a run without names renews the sheet whole, so long parts come after it. ``python -m benchmarks.sheets``
writes the sheets of the docs from ``benchmarks/results``.
"""

from __future__ import annotations

import datetime
import importlib
import platform
import sys
from inspect import signature
from pathlib import Path
from types import ModuleType

from benchmarks.common.sheet import processor

COMMANDS = {
    "ablation": "ablation.runs",
    "accuracy": "localization.tours",
    "arm": "arm.parts",
    "attacks": "attacks.command",
    "belief": "localization.belief",
    "camera": "camera.parts",
    "console": "console.parts",
    "delays": "wire.delays",
    "failures": "failures.command",
    "guard": "guard.campaign",
    "kafka": "bridges.kafka",
    "localization": "localization.comparison",
    "lanes": "wire.lanes",
    "log": "localization.log_files",
    "motion": "bridges.motion",
    "path": "prediction.errors",
    "people": "localization.people",
    "prepared": "localization.prepared_map",
    "real": "real.command",
    "rosbridge": "bridges.rosbridge",
    "sim": "sim.speed",
    "soak": "wire.soak",
    "surfaces": "localization.surfaces",
    "tour": "sim.tour",
    "video": "camera.video",
    "watchdog": "wire.watchdog",
    "webrtc": "camera.webrtc",
    "wire": "wire.stick_to_wheel",
}
"""The benchmarks by name, each with the module that runs it."""


def main() -> int:
    """Run each module's ``main``, which prints a table; say when and on what machine."""
    words, folders = sys.argv[1:], dict[str, Path]()
    for option in ("out", "real", "mirror"):
        if f"--{option}" in words:
            at = words.index(f"--{option}")
            if at + 1 == len(words):
                print(f"--{option} requires a folder", file=sys.stderr)
                return 2
            folders[option] = Path(words[at + 1])
            del words[at : at + 2]
    chosen: dict[str, list[str]] = {} if words else {name: [] for name in COMMANDS}
    modules: dict[str, ModuleType] = {}
    for word in words:
        last = list(chosen)[-1] if chosen else ""
        if last and (_takes_words(modules[last]) or word in getattr(modules[last], "PARTS", ())):
            chosen[last].append(word)
        elif word in COMMANDS:
            chosen[word], modules[word] = [], _module(word)
        else:
            there = ", ".join(COMMANDS)
            print(f"no benchmark or part {word}; the benchmarks are {there}", file=sys.stderr)
            return 2
    print(f"{datetime.datetime.now():%Y-%m-%d}, {processor()}, Python {platform.python_version()}")
    for name, parts in chosen.items():
        module = _module(name)
        print(f"\n{name}: {(module.__doc__ or '').partition(chr(10))[0]}", flush=True)
        taken = signature(module.main).parameters
        given = {option: folder for option, folder in folders.items() if option in taken}
        if "out" in given:
            given["out"] /= f"{name}.json"
        module.main(*([parts] if parts else []), **given)
    return 0


def _module(name: str) -> ModuleType:
    """Return the module of a benchmark; what one needs, another does not load."""
    return importlib.import_module(f"benchmarks.{COMMANDS[name]}")


def _takes_words(module: ModuleType) -> bool:
    """Return whether all words after a benchmark's name are its own arguments."""
    return bool(getattr(module, "TAKES_WORDS", False))


if __name__ == "__main__":
    sys.exit(main())
