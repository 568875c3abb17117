"""Media types of the interface: which format a body has, and in which one an answer is wanted."""

from __future__ import annotations

import re
from typing import Final, Literal, TypeAlias

from teleop.bridges.rest.errors import Failure

Format: TypeAlias = Literal["json", "binary"]
"""How keys and values of records are embedded: as they are, or as base64."""

PLAIN: Final = "application/vnd.kafka.v2+json"
"""Of everything that holds no records."""

EMBEDDED: Final[dict[str, Format]] = {
    "application/vnd.kafka.json.v2+json": "json",
    "application/vnd.kafka.binary.v2+json": "binary",
}
"""Of what holds records."""

_GENERIC: Final = ("application/vnd.kafka+json", "application/json")


def embedded_format(content_type: str) -> Format:
    """Return the format of the records in a body; 415 if it has none."""
    found = EMBEDDED.get(_bare(content_type))
    if found is None:
        raise Failure.UNSUPPORTED_MEDIA_TYPE.error(" or ".join(EMBEDDED))
    return found


def check_plain(content_type: str) -> None:
    """Refuse with 415 a body that is no JSON.

    The glasses create their consumer with the media type of records, and so does this.
    """
    if _bare(content_type) not in (PLAIN, *EMBEDDED, *_GENERIC):
        raise Failure.UNSUPPORTED_MEDIA_TYPE.error(PLAIN)


def accepted_plain(accept: str) -> str:
    """Return the media type of an answer without records; 406 if the client takes none."""
    return _choose(accept, (PLAIN, *_GENERIC))


def accepted_embedded(accept: str, format: Format) -> str:
    """Return the media type of records in a consumer's format; 406 if the client takes none."""
    own = next(media for media, of in EMBEDDED.items() if of == format)
    generic = _GENERIC if format == "json" else ()
    return _choose(accept, (own, *generic))


def _choose(accept: str, offered: tuple[str, ...]) -> str:
    """Return the first offered type that an ``Accept`` allows; without one the first."""
    ranges = [_bare(part) for part in accept.split(",") if not _refused(part)]
    if not accept.strip():
        return offered[0]
    for media in ranges:
        if media in offered:
            return media
        if media in ("*/*", "application/*"):
            return offered[0]
    raise Failure.NOT_ACCEPTABLE.error(offered[0])


def _bare(media: str) -> str:
    return media.partition(";")[0].strip().lower()


def _refused(part: str) -> bool:
    return re.search(r";\s*q\s*=\s*0(\.0*)?\s*(;|$)", part) is not None
