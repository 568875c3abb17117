"""What Dask loads first in a worker of this machine."""

from __future__ import annotations

import signal


def dask_setup(worker: object) -> None:
    """Let Ctrl-C, which a terminal sends to all processes, end the command alone, which then ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
