"""What a client may do: its role, and which names each role may use."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from enum import StrEnum
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import Final, Literal, TypeAlias

from teleop.rosbridge.topic_names import canonical

Act: TypeAlias = Literal["subscribe", "publish", "call", "provide"]
"""What is done with a name; a goal is a call, and who advertises is going to publish."""


class Role(StrEnum):
    """How far a client is trusted; each may do what those before it may."""

    VIEW = "view"
    """Looks on."""

    OPERATE = "operate"
    """Publishes and calls services as well: drives."""

    ADMIN = "admin"
    """Changes the server as well: its parameters, and who provides what."""

    @property
    def rank(self) -> int:
        """Place among the roles, 0 for the least."""
        return list(Role).index(self)


@dataclass(frozen=True, slots=True)
class RoleRules:
    """Patterns of names, as a shell's; one that begins with ``!`` takes names out again."""

    subscribe: tuple[str, ...] = ()
    """Topics to hear."""

    publish: tuple[str, ...] = ()
    """Topics to advertise and to publish on."""

    call: tuple[str, ...] = ()
    """Services and actions to call."""

    provide: tuple[str, ...] = ()
    """Services and actions to offer to other clients."""

    def __post_init__(self) -> None:
        for act in fields(self):
            for pattern in getattr(self, act.name):
                if not pattern.removeprefix("!").startswith(("/", "*")):
                    raise ValueError(
                        f"{act.name}: {pattern!r} fits no name, since all names begin with a /"
                    )

    def allow(self, act: Act, name: str) -> bool:
        """Return whether a name may be used so."""
        patterns: tuple[str, ...] = getattr(self, act)
        return patterns == ("*",) or _fits(patterns, canonical(name))


_CHANGES: Final = ("/rosapi/set_param", "/rosapi/delete_param")
"""Services of ``/rosapi`` that change what others read."""

DEFAULT_RULES: Final = {
    Role.VIEW: RoleRules(
        subscribe=("*",),
        # The first roslib asks for transforms by topics, later ones by service or action.
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
"""What each role may do unless a file of tokens says otherwise."""


@dataclass(frozen=True, slots=True)
class Access:
    """A client that has been let in."""

    holder: str
    """Whose token it brought; empty if it brought none."""

    role: Role
    rules: RoleRules
    key: bytes = field(default=b"", repr=False, compare=False)
    """Digest of what it brought, by which it is found again; empty if it brought nothing."""

    def refusal(self, act: Act, name: str) -> str | None:
        """Return why a name may not be used so; None if it may."""
        if self.rules.allow(act, name):
            return None
        return f"the role {self.role} may not {act} {name[:256]}"


UNGUARDED: Final = Access("", Role.ADMIN, DEFAULT_RULES[Role.ADMIN])
"""Of every client, where nobody asks who it is."""


@lru_cache(maxsize=4096)
def _fits(patterns: tuple[str, ...], name: str) -> bool:
    chosen = [pattern for pattern in patterns if not pattern.startswith("!")]
    barred = [pattern[1:] for pattern in patterns if pattern.startswith("!")]
    return any(fnmatchcase(name, pattern) for pattern in chosen) and not any(
        fnmatchcase(name, pattern) for pattern in barred
    )
