"""Both futures as the display draws them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from localization.display.futures_recording import Future
from localization.evaluation.tum_file import read_tum
from localization.report.plain_text import plain_text
from teleop.scenario.referee.outcome import Outcome
from teleop.scenario.whatif.fork import Futures
from teleop.scenario.whatif.futures_page import NAMES


def futures_of(futures: Futures, run: Path, out: Path) -> list[Future]:
    """Return the run and its fork.

    Args:
        futures: Their outcomes.
        run: Folder of the run.
        out: Folder of the fork.
    """
    parts = ((futures.actual, run), (futures.forked, out))
    return [_future(name, *part) for name, part in zip(NAMES, parts, strict=True)]


def _future(name: str, outcome: Outcome, folder: Path) -> Future:
    lines = outcome.lines
    figures = {
        "Position error [m]": np.nan_to_num(lines.error),
        "Forward [m/s]": lines.speed[:, 0],
        "Turn [rad/s]": lines.speed[:, 1],
    }
    events = [(event.stamp, plain_text(event.text)) for event in outcome.events]
    return Future(name, read_tum(folder / "truth.tum"), lines.stamps, figures, events)
