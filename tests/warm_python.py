"""A Python that has imported the libraries: programs run in forks of it, as if by themselves.

A program of the documentation computes for half a second and imports for two, most of it libraries of other people.
None of our modules is among them: each program imports those that it names.
"""

from __future__ import annotations

import gc
import importlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType, TracebackType
from typing import Final

_LIBRARIES: Final = (
    *(
        "asyncio",
        "filterpy.kalman",
        "kiss_icp.mapping",
        "PIL.Image",
        "pydantic",
        "rosbags.highlevel",
    ),
    *(
        "scipy.ndimage",
        "scipy.sparse.csgraph",
        "scipy.sparse.linalg",
        "scipy.spatial",
        "scipy.stats",
    ),
)


class WarmPython:
    """Runs programs one after the other; a context manager that ends what still runs."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        """Start it; all programs have this environment, and a warning is an error to them."""
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-W", "error", __file__],
            env={**environment, "OPENBLAS_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def __enter__(self) -> WarmPython:
        """Return it."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """End it, with a program that hangs."""
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.communicate()

    def run(self, *words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
        """Run ``-c`` and a text, or the path of a file, with arguments, in a folder; return its end."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with TemporaryDirectory() as folder:
            streams = [Path(folder) / name for name in ("out", "err")]
            order = {"cwd": str(cwd), "streams": [*map(str, streams)], "words": words}
            self._process.stdin.write(f"{json.dumps(order)}\n")
            self._process.stdin.flush()
            status = int(self._process.stdout.readline())
            out, err = (stream.read_text(encoding="utf-8") for stream in streams)
        return subprocess.CompletedProcess(words, status, out, err)


def _program() -> list[str] | None:
    """Fork for each order that comes; return its words in the fork, and None when no more come."""
    for name in _LIBRARIES:
        importlib.import_module(name)
    gc.freeze()  # no fork shall look through all that when it ends
    for line in sys.stdin:
        order = json.loads(line)
        fork = os.fork()
        if fork == 0:
            os.chdir(order["cwd"])
            os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
            for number, path in enumerate(order["streams"], start=1):
                os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT), number)
            words: list[str] = order["words"]
            return words
        _, status = os.waitpid(fork, 0)
        sys.stdout.write(f"{os.waitstatus_to_exitcode(status)}\n")
        sys.stdout.flush()
    return None


def _run(words: list[str]) -> None:
    """Be the program; it ends as Python ends."""
    assert not {"localization", "robot_sim", "teleop"} & set(sys.modules)
    main = sys.modules["__main__"] = ModuleType("__main__")
    if words[0] == "-c":
        sys.argv, text, name = ["-c", *words[2:]], words[1], "<string>"
        sys.path.insert(0, "")
    else:
        sys.argv, text, name = words, Path(words[0]).read_text(encoding="utf-8"), words[0]
        sys.path.insert(0, str(Path(name).parent))
        main.__file__ = name
    exec(compile(text, name, "exec"), main.__dict__)


if __name__ == "__main__":
    given = _program()
    if given is not None:
        _run(given)
