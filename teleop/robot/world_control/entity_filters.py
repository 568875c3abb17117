"""Filters of entities and named poses, as requests have them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

from teleop.robot.world_control.interface import Entity
from teleop.robot.world_control.results import Code, ControlError

_LONGEST: Final = 200
"""Length of a regular expression [characters]."""
_ANY: Final = 0


def matching(entities: Mapping[str, Entity], filters: Mapping[str, Any]) -> list[str]:
    """Return the names of the entities that an ``EntityFilters`` selects.

    Raises:
        ControlError: The filter is no regular expression, or selects by bounds, which is not offered.
    """
    bounds = filters["bounds"]
    if bounds["type"] or bounds["points"]:
        raise ControlError(Code.UNSUPPORTED, "entities cannot be selected by bounds here")
    pattern = filters["filter"]
    if len(pattern) > _LONGEST:
        raise ControlError(Code.FAILED, f"a filter may have at most {_LONGEST} characters")
    try:
        expression = re.compile(pattern)
    except re.error as error:
        raise ControlError(Code.FAILED, f"the filter is no regular expression: {error}") from None
    wanted = {category["category"] for category in filters["categories"]}
    return [
        name
        for name, entity in entities.items()
        if expression.search(name)
        and (not wanted or int(entity.category) in wanted)
        and has_tags(entity.tags, filters["tags"])
    ]


def has_tags(tags: tuple[str, ...], wanted: Mapping[str, Any]) -> bool:
    """Return whether a ``TagsFilter`` selects something with these tags."""
    if not wanted["tags"]:
        return True
    found = [tag in tags for tag in wanted["tags"]]
    return any(found) if wanted["filter_mode"] == _ANY else all(found)
