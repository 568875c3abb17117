"""Which topics clients may name."""

from __future__ import annotations

import re
from typing import Final

from teleop.bridges.rest.errors import Failure

_TOPIC: Final = re.compile(r"[A-Za-z0-9._-]{1,249}")


def is_internal(topic: str) -> bool:
    """Return whether a topic is the broker's own, such as ``__consumer_offsets``."""
    return topic.startswith("__")


def check_topic(topic: object) -> None:
    """Refuse what is no name of a topic, with 404, and the broker's own topics, with 403."""
    if not isinstance(topic, str) or not _TOPIC.fullmatch(topic) or topic in (".", ".."):
        raise Failure.NO_TOPIC.error(str(topic))
    if is_internal(topic):
        raise Failure.FORBIDDEN.error(
            f"{topic:.60} is the broker's own, as all topics that begin with __"
        )
