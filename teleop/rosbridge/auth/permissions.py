"""Permissions of clients: roles, and the names that each role may use."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from enum import StrEnum
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import Final, Literal, TypeAlias

from teleop.rosbridge.topic_names import canonical

Act: TypeAlias = Literal["subscribe", "publish", "call", "provide"]
"""Use of a name; sending a goal is a call, and advertising is publishing."""


class Role(StrEnum):
    """Roles in ascending order of permissions."""

    VIEW = "view"
    """Subscribes only."""

    OPERATE = "operate"
    """Also publishes and calls services, so it can drive."""

    ADMIN = "admin"
    """Also sets parameters and provides services and actions."""

    @property
    def rank(self) -> int:
        """Position among the roles, 0 for the lowest."""
        return list(Role).index(self)


@dataclass(frozen=True, slots=True)
class RoleRules:
    """Shell patterns of names; one that begins with ``!`` excludes names."""

    subscribe: tuple[str, ...] = ()
    """Topics that may be subscribed."""

    publish: tuple[str, ...] = ()
    """Topics that may be advertised and published."""

    call: tuple[str, ...] = ()
    """Services and actions that may be called."""

    provide: tuple[str, ...] = ()
    """Services and actions that may be provided to other clients."""

    def __post_init__(self) -> None:
        for act in fields(self):
            for pattern in getattr(self, act.name):
                if not pattern.removeprefix("!").startswith(("/", "*")):
                    raise ValueError(
                        f"{act.name}: {pattern!r} matches no name, since all names begin with a /"
                    )

    def allow(self, act: Act, name: str) -> bool:
        """Return whether a name may be used in this way."""
        patterns: tuple[str, ...] = getattr(self, act)
        return patterns == ("*",) or _matches(patterns, canonical(name))


_CHANGES: Final = ("/rosapi/set_param", "/rosapi/delete_param")
"""Services of ``/rosapi`` that change parameters."""

DEFAULT_RULES: Final = {
    Role.VIEW: RoleRules(
        subscribe=("*",),
        # roslib 1 requests transforms by topics, later versions by service or action.
        publish=("/tf2_web_republisher/goal", "/tf2_web_republisher/cancel"),
        call=(
            *("/rosapi/*", "/republish_tfs", "/tf2_web_republisher"),
            *(f"!{service}" for service in _CHANGES),
        ),
    ),
    Role.OPERATE: RoleRules(
        subscribe=("*",), publish=("*",), call=("*", *(f"!{service}" for service in _CHANGES))
    ),
    Role.ADMIN: RoleRules(("*",), ("*",), ("*",), ("*",)),
}
"""Rules of each role, unless a token file changes them."""


@dataclass(frozen=True, slots=True)
class Access:
    """Permissions of an authenticated client."""

    holder: str
    """Name of the token's holder; empty without a token."""

    role: Role
    rules: RoleRules
    key: bytes = field(default=b"", repr=False, compare=False)
    """Digest of the credential that granted the access; empty without one."""
    link: bool = False
    """Whether the token is that of a link, which several people may have."""

    def refusal(self, act: Act, name: str) -> str | None:
        """Return why a name may not be used in this way; None if it may."""
        if self.rules.allow(act, name):
            return None
        return f"role {self.role} may not {act} {name[:256]}"


UNGUARDED: Final = Access("", Role.ADMIN, DEFAULT_RULES[Role.ADMIN])
"""Access of every client on a server without authentication."""


@lru_cache(maxsize=4096)
def _matches(patterns: tuple[str, ...], name: str) -> bool:
    included = [pattern for pattern in patterns if not pattern.startswith("!")]
    excluded = [pattern[1:] for pattern in patterns if pattern.startswith("!")]
    return any(fnmatchcase(name, pattern) for pattern in included) and not any(
        fnmatchcase(name, pattern) for pattern in excluded
    )
