"""Tokens and secrets with their permissions: read from a file, compared in constant time."""

from __future__ import annotations

import hashlib
import hmac
import math
import os
import re
import stat
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from datetime import datetime
from pathlib import Path
from typing import Any, Final

from teleop.rosbridge.auth.permissions import DEFAULT_RULES, Access, Role, RoleRules
from teleop.rosbridge.errors import ServerError

_MIN_LENGTH: Final = 16
"""Length of a token or secret [characters]; shorter ones could be guessed."""

_DIGEST: Final = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True, slots=True)
class Credential:
    """The digest of a token, or a secret for rosauth codes, with its permissions."""

    access: Access
    digest: bytes = field(default=b"", repr=False)
    """SHA-256 of the token; empty for a secret."""

    secret: str = field(default="", repr=False)

    until: float = math.inf
    """Unix time from which it is not valid any more [s]."""

    @property
    def granted(self) -> Access:
        """The permissions, marked with the credential that granted them."""
        return replace(self.access, key=self._mark)

    def matches(self, access: Access) -> bool:
        """Return whether this credential granted an access."""
        return hmac.compare_digest(self._mark, access.key)

    @property
    def _mark(self) -> bytes:
        return self.digest or token_digest(self.secret)


@dataclass(frozen=True, slots=True)
class Credentials:
    """All tokens and secrets, and the permissions of clients without."""

    keys: tuple[Credential, ...] = ()
    anonymous: Access | None = None
    """Permissions of clients without a token; None if a token is required."""

    rules: Mapping[Role, RoleRules] = field(default_factory=lambda: DEFAULT_RULES)
    """Rules of each role."""

    def valid_at(self, time: float) -> Credentials:
        """Return these without what is not valid any more at a Unix time [s]."""
        return replace(self, keys=tuple(key for key in self.keys if time < key.until))

    def find(self, token: str) -> Access | None:
        """Return the permissions of a token; None if it is unknown. Takes constant time."""
        digest = token_digest(token)
        found = None
        for key in self.keys:
            if hmac.compare_digest(key.digest, digest):
                found = key.granted
        return found

    def still_grant(self, access: Access) -> bool:
        """Return whether an authenticated client would be given the same permissions now."""
        if not access.key:
            return access == self.anonymous
        for key in self.keys:
            if key.matches(access):
                return access == self.restricted(key.access, access.role)
        return False

    def restricted(self, access: Access, level: str) -> Access:
        """Return the access of a lower role, if ``level`` is one; otherwise the access itself."""
        if level not in list(Role) or Role(level).rank >= access.role.rank:
            return access
        return replace(access, role=Role(level), rules=self.rules[Role(level)])


def read_credentials(path: Path, rules: Mapping[Role, RoleRules] = DEFAULT_RULES) -> Credentials:
    """Read a token file; ``docs/security.md`` describes its format.

    Args:
        path: The file, which only its owner may be able to read.
        rules: Rules of each role, unless the file changes them.

    Raises:
        ServerError: If it is invalid; the message is one line and contains no secret.
    """
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            if mode & (stat.S_IRWXG | stat.S_IRWXO):
                raise ServerError(
                    f"{path} contains secrets but is accessible to others: chmod 600 {path.name}"
                )
            content = tomllib.load(file)
    except OSError as error:
        raise ServerError(f"cannot read the tokens in {path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError):
        # The text of the parser's error may contain a secret.
        raise ServerError(f"{path} is not valid TOML") from None
    try:
        return _parse(content, rules)
    except ValueError as error:
        raise ServerError(f"{path}: {error}") from None


def _parse(content: dict[str, Any], defaults: Mapping[Role, RoleRules]) -> Credentials:
    _only(content, ("anonymous", "roles", "tokens"), "the file")
    rules = {role: defaults[role] for role in Role}
    for name, changes in _tables(content, "roles").items():
        role = _role(name, "a table of roles")
        rules[role] = replace(rules[role], **_patterns(changes, f"roles.{name}"))
    keys = tuple(_key(name, entry, rules) for name, entry in _tables(content, "tokens").items())
    digests = [key.digest for key in keys if key.digest]
    if len(set(digests)) < len(digests):
        raise ValueError("two names have the same token")
    anonymous = None
    if "anonymous" in content:
        role = _role(content["anonymous"], "anonymous")
        anonymous = Access("", role, rules[role])
    if not keys and anonymous is None:
        raise ValueError("it has no tokens, so no client could connect")
    return Credentials(keys, anonymous, rules)


def _key(name: str, entry: dict[str, Any], rules: Mapping[Role, RoleRules]) -> Credential:
    where = f"tokens.{name}"
    kinds = ("token", "sha256", "secret")
    _only(entry, ("role", "until", "link", *kinds), where)
    role = _role(entry.get("role"), f"{where}.role")
    given = [kind for kind in kinds if kind in entry]
    if len(given) != 1:
        raise ValueError(f"{where} must have one of token, sha256 and secret")
    value = entry[given[0]]
    if not isinstance(value, str) or len(value) < _MIN_LENGTH:
        raise ValueError(f"{where}.{given[0]} must be a string of {_MIN_LENGTH} or more characters")
    until, link = entry.get("until"), entry.get("link", False)
    if until is not None and not (isinstance(until, datetime) and until.tzinfo):
        raise ValueError(
            f"{where}.until must be a time with its zone, such as 2026-11-25T18:00:00Z"
        )
    if not isinstance(link, bool):
        raise ValueError(f"{where}.link must be true or false")
    access = Access(name, role, rules[role], link=link)
    end = math.inf if until is None else until.timestamp()
    if given[0] == "secret":
        return Credential(access, secret=value, until=end)
    if given[0] == "token":
        return Credential(access, digest=token_digest(value), until=end)
    if not _DIGEST.fullmatch(value.lower()):
        raise ValueError(f"{where}.sha256 must be 64 hexadecimal digits")
    return Credential(access, digest=bytes.fromhex(value), until=end)


def token_digest(token: str) -> bytes:
    """Return the SHA-256 of a token."""
    return hashlib.sha256(token.encode(errors="surrogatepass")).digest()


def _role(name: object, where: str) -> Role:
    try:
        return Role(str(name))
    except ValueError:
        raise ValueError(f"{where} must be one of {', '.join(Role)}") from None


def _patterns(changes: dict[str, Any], where: str) -> dict[str, tuple[str, ...]]:
    _only(changes, tuple(act.name for act in fields(RoleRules)), where)
    for act, patterns in changes.items():
        if not isinstance(patterns, list) or not all(isinstance(p, str) for p in patterns):
            raise ValueError(f'{where}.{act} must be a list of patterns, such as ["/joy"]')
    return {act: tuple(patterns) for act, patterns in changes.items()}


def _tables(content: dict[str, Any], key: str) -> dict[str, dict[str, Any]]:
    tables = content.get(key, {})
    if not isinstance(tables, dict) or not all(isinstance(t, dict) for t in tables.values()):
        raise ValueError(f"{key} must be tables, such as [{key}.NAME]")
    return tables


def _only(table: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    if unknown := sorted(set(table) - set(known)):
        raise ValueError(f"{where} has no {unknown[0]!r}; it has {', '.join(known)}")
