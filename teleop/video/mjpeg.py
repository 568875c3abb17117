"""Motion JPEG: pictures as the parts of one response, as ``web_video_server`` and browsers write and read them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import Final

from teleop.pictures.picture import Picture
from teleop.pictures.picture_hub import Watch
from teleop.video.refusal import OWN_PAGES_ONLY

BOUNDARY: Final = "boundarydonotcross"
"""What separates parts, as in ``web_video_server``, for readers that search for it."""

NEVER_CACHED: Final = "no-cache, no-store, must-revalidate, max-age=0"
"""``Cache-Control`` of what is old at once."""

STREAM_HEADERS: Final = {
    "Content-Type": f"multipart/x-mixed-replace;boundary={BOUNDARY}",
    "Cache-Control": NEVER_CACHED,
    "Pragma": "no-cache",
    **OWN_PAGES_ONLY,
}
"""Header of a stream."""

_CHECK_PERIOD: Final = 1_000_000_000
"""Time of the robot between two checks whether a viewer may go on watching [ns]."""


def stamp_text(stamp: int) -> str:
    """Return a stamp [ns] as seconds with nine decimals, for ``X-Timestamp``."""
    return f"{stamp // 1_000_000_000}.{stamp % 1_000_000_000:09d}"


def part(picture: Picture) -> bytes:
    """Return a picture as a part, with the boundary after it.

    Readers show a picture when they see the boundary that follows, which must not wait for the next picture.
    """
    head = (
        f"Content-type: image/jpeg\r\nX-Timestamp: {stamp_text(picture.stamp)}\r\n"
        f"Content-Length: {len(picture.data)}\r\n\r\n"
    )
    return b"".join((head.encode(), picture.data, f"\r\n--{BOUNDARY}\r\n".encode()))


async def mjpeg(watch: Watch, may_go_on: Callable[[], bool], rate: int = 0) -> AsyncIterator[bytes]:
    """Yield the parts of a stream; of the pictures that come in between, a slow viewer gets the newest.

    Args:
        watch: The viewer's watch; its owner closes it.
        may_go_on: Returns whether the viewer may go on watching; asked once a second.
        rate: Most pictures in a second; 0 for all. Between two of them nothing is watched, so that nothing is drawn.
    """
    loop = asyncio.get_running_loop()
    yield f"--{BOUNDARY}\r\n".encode()
    checked: int | None = None
    while True:
        begun = loop.time()
        picture = await watch.next()
        if checked is None or not 0 <= picture.stamp - checked < _CHECK_PERIOD:
            checked = picture.stamp
            if not may_go_on():
                return
        yield part(picture)
        if rate > 0:
            watch.rest()
            await asyncio.sleep(begun + 1.0 / rate - loop.time())
            watch.resume()
