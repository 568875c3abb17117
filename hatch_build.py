"""Build hook: the console page is built before it is packed, where that is possible."""

from __future__ import annotations

import os
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SKIP = "FARSTEER_SKIP_CONSOLE"
"""Variable that leaves the page out; `make env` builds it afterwards, in its own environment."""


class CustomBuildHook(BuildHookInterface[Any]):
    """Runs ``tools/build-console``; the page of a source distribution is in it, and needs no Node."""

    def dependencies(self) -> list[str]:
        """Return the package that brings Node, unless there is one or nothing is to be built."""
        tool = runpy.run_path(str(self._tool))
        if os.environ.get(SKIP) or tool["is_built"]() or tool["node_of_path"]():
            return []
        return [tool["NODE_PACKAGE"]]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page; without it the package works, and `farsteer serve` says what is missing."""
        if os.environ.get(SKIP):
            return
        done = subprocess.run([sys.executable, str(self._tool)], check=False)
        if done.returncode:
            self.app.display_warning(
                "the console page is not built: `farsteer serve` drives on without it"
            )

    @property
    def _tool(self) -> Path:
        return Path(self.root, "tools", "build-console")
