"""A localiser that is a script of somebody else, run on a real log and scored like a submission.

The script is called with ``--log``, ``--gfs`` (the corrected log), ``--map even``, ``--limit`` (a number of scans from the
first corrected one on) and ``--tum PREFIX``; it writes ``PREFIX_est.tum`` and prints JSON, in which
``icp_ms`` is its mean time per scan.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.real.submissions import Submission, read_submission


class YardstickError(ValueError):
    """The script could not be run; the message is one line."""


def run_yardstick(script: Path, folder: Path, name: str, scans: int) -> tuple[Submission, float]:
    """Return the poses that a script finds on a log's first scans, and its mean time per scan [ms].

    Args:
        script: runs in this Python.
        folder: of the logs.
        name: of the log.
        scans: how many, counted from the first corrected one of the log.

    Raises:
        YardstickError: if the script fails, or prints no JSON with ``icp_ms``.
        SubmissionError: if it writes no poses.
    """
    with tempfile.TemporaryDirectory() as made:
        prefix = Path(made) / name
        words = ["--log", folder / f"{name}.clf.bz2", "--gfs", folder / f"{name}-corrected.log.gz"]
        words += ["--map", "even", "--limit", scans, "--tum", prefix]
        done = subprocess.run(
            [sys.executable, str(script), *map(str, words)],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise YardstickError(f"{script}: failed on {name}: {last}")
        try:
            ms = float(json.loads(done.stdout)["icp_ms"])
        except (ValueError, KeyError, TypeError) as error:
            raise YardstickError(
                f"{script}: must print JSON with a number icp_ms, got {done.stdout[:80]!r}"
            ) from error
        return read_submission(Path(f"{prefix}_est.tum")), ms
