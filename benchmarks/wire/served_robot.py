"""A robot that the command serves in real time, in processes of its own."""

from __future__ import annotations

import asyncio
import os
import re
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager


@asynccontextmanager
async def served_robot(*options: str) -> AsyncIterator[tuple[str, int]]:
    """Serve a robot on a free port; yield its address and process.

    Args:
        options: Further options of ``farsteer serve``.
    """
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "teleop", "serve", "--port", "0", *options),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    try:
        assert process.stdout is not None
        found = None
        while found is None:
            line = (await process.stdout.readline()).decode()
            if not line:
                raise SystemExit("farsteer serve has ended")
            found = re.search(r"wss?://\S+", line)
        await asyncio.sleep(3.0)
        yield found[0], process.pid
    finally:
        process.terminate()
        await process.communicate()
