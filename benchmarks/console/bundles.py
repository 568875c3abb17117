"""Scripts for measurements, bundled with the page's own modules, and the page with the names of its modules kept."""

from __future__ import annotations

import bisect
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PAGE = ROOT / "teleop" / "console" / "page"


def bundled(script: str) -> bytes:
    """Return a script of this folder, bundled as the page is."""
    found = sorted((PAGE / "node_modules" / "@esbuild").glob("*/bin/esbuild"))
    if not found:
        raise SystemExit("esbuild is not there: tools/build-console fetches it")
    made = subprocess.run(
        [found[0], HERE / script, "--bundle", "--minify", "--format=esm", "--target=chrome110"],
        env={**os.environ, "NODE_PATH": str(PAGE / "node_modules")},
        capture_output=True,
        check=True,
    )
    return made.stdout


def readable_page() -> Path:
    """Build the page so that a profile can be read; return its folder."""
    folder = ROOT / "build" / "readable-console"
    words = ("--fetch-node", "--dev", "--readable", folder)
    subprocess.run([sys.executable, ROOT / "tools" / "build-console", *words], check=True)
    return folder


class Modules:
    """Which module a line of a readable page's scripts belongs to, by the comments that esbuild leaves."""

    def __init__(self, page: Path) -> None:
        self._starts = {
            file.name: [
                (at, line[3:])
                for at, line in enumerate(file.read_text(encoding="utf-8").splitlines())
                if re.match(r"// (src|node_modules)/", line)
            ]
            for file in page.rglob("*.js")
        }

    def of(self, frame: Mapping[str, Any]) -> str:
        """Return the module of a call frame of DevTools; empty for what is not of the page."""
        starts = self._starts.get(str(frame["url"]).rpartition("/")[2], [])
        at = bisect.bisect_right(starts, int(frame["lineNumber"]), key=lambda start: start[0])
        return starts[at - 1][1] if at > 0 else ""
