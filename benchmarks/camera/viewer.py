"""A viewer in a process of its own: ``python -m benchmarks.camera.viewer URL`` takes what comes, and writes a line for each JPEG."""

from __future__ import annotations

import asyncio
import json
import sys

from websockets.asyncio.client import connect

TOPICS = ("/camera/rgb/image_raw/compressed", "/camera/depth/image_raw")


async def _view(url: str) -> None:
    async with connect(url, compression=None, max_size=None, proxy=None) as connection:
        for topic in TOPICS:
            operation = {"op": "subscribe", "topic": topic, "compression": "cbor"}
            await connection.send(json.dumps(operation))
        async for frame in connection:
            if isinstance(frame, bytes) and TOPICS[0].encode() in frame[:100]:
                sys.stdout.write("\n")  # counted by who started this
                sys.stdout.flush()


if __name__ == "__main__":
    asyncio.run(_view(sys.argv[1]))
