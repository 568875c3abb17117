"""The list of tokens of ``--lan``: one for each device, each with a name; those of links make them.

A link is opened by anybody who has it, and each device that opens it gets a token of its own from the robot. So a
device can be shut out alone, and a link can end without shutting out who came by it.
"""

from __future__ import annotations

import hashlib
import json
import re
import secrets
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import Final

from teleop.console.lan.state_files import read_private, write_private
from teleop.errors import SettingError

try:
    import fcntl
except ImportError:  # not a POSIX system
    fcntl = None  # type: ignore[assignment]

MACHINE: Final = "lan"
"""Name of this machine's own token, which is kept in a file beside the list."""
MOST: Final = 64
"""Tokens in a list; more than a person looks through."""
_HEAD: Final = (
    "# Kept by `farsteer serve --lan`: digests of tokens. `farsteer tokens` lists and revokes them."
)
_TOKEN: Final = re.compile(r"[A-Za-z0-9_-]{16,256}")


@dataclass(frozen=True, slots=True)
class ListedToken:
    """A token of the list."""

    name: str
    """Its unique name: that of the device or the link."""
    role: str
    """``view``, ``operate`` or ``admin``."""
    sha256: str
    """Digest of its text, in hexadecimal digits."""
    until: datetime | None = None
    """When it ends; None if it does not."""
    link: bool = False
    """Whether it is that of a link."""

    @property
    def text(self) -> str:
        """The token as it stands in the file."""
        lines = [
            f"[tokens.{json.dumps(self.name, ensure_ascii=False)}]",
            f'role = "{self.role}"',
            f'sha256 = "{self.sha256}"',
            *([f"until = {self.until.isoformat()}"] if self.until else []),
            *(["link = true"] if self.link else []),
        ]
        return "\n".join(lines)


class TokenBook:
    """Reads and changes the list; each change is on the disk when its method returns."""

    def __init__(self, file: Path) -> None:
        """Take the file of the list, which is made with its first token."""
        self.file = file

    @property
    def kept(self) -> bool:
        """Whether the file is such a list, and not one that a person keeps."""
        return (read_private(self.file) or b"").startswith(_HEAD.encode())

    def tokens(self, now: datetime) -> tuple[ListedToken, ...]:
        """Return the tokens that have not ended.

        Raises:
            SettingError: If the file cannot be read.
        """
        try:
            content = tomllib.loads((read_private(self.file) or b"").decode())
            listed = [ListedToken(name, **entry) for name, entry in content["tokens"].items()]
        except KeyError:
            return ()
        except (ValueError, TypeError, AttributeError):
            raise SettingError(
                f"{self.file} is no list of tokens: delete it, and another one is made"
            ) from None
        return tuple(token for token in listed if token.until is None or now < token.until)

    def add(
        self, name: str, role: str, now: datetime, until: datetime | None, *, link: bool = False
    ) -> tuple[ListedToken, str]:
        """Make a token; return its entry, whose name has a number behind it if there is one of the same, and its text.

        Raises:
            SettingError: If the list is full, or cannot be written.
        """
        token = secrets.token_urlsafe(32)
        with self._locked():
            listed = self.tokens(now)
            if len(listed) >= MOST:
                raise SettingError(
                    f"there are {MOST} tokens; revoke one, or wait for the end of one"
                )
            taken = {other.name.casefold() for other in listed}
            names = (name if n == 1 else f"{name} {n}" for n in count(1))
            free = next(each for each in names if each.casefold() not in taken)
            made = ListedToken(free, role, _digest(token), until, link)
            self._write((*listed, made))
        return made, token

    def remove(self, name: str, now: datetime) -> None:
        """Take a token out of the list, for good.

        Raises:
            SettingError: If there is none of this name, or it is this machine's own; the message says what would help.
        """
        with self._locked():
            listed = self.tokens(now)
            if name == MACHINE:
                raise SettingError(
                    f"{MACHINE} is this machine's own token: delete {self.file.with_name('token')}, and"
                    " start the robot again"
                )
            if name not in [token.name for token in listed]:
                names = ", ".join(token.name for token in listed if token.name != MACHINE)
                raise SettingError(f"there is no token {name[:80]!r}; there are: {names or 'none'}")
            self._write([token for token in listed if token.name != name])

    def ensure_machine(self, file: Path, now: datetime) -> str:
        """Return this machine's own token, of an admin, which is made unless its file is there.

        Raises:
            SettingError: If a file cannot be read or written, is accessible to others, or holds no token.
        """
        content = read_private(file)
        if content is None:
            write_private(file, f"{secrets.token_urlsafe(32)}\n".encode(), replace=False)
            content = read_private(file) or b""
        token = content.decode(errors="replace").strip()
        if not _TOKEN.fullmatch(token):
            raise SettingError(f"{file} holds no token: delete it, and another one is made")
        with self._locked():
            others = [one for one in self.tokens(now) if one.name != MACHINE]
            self._write([ListedToken(MACHINE, "admin", _digest(token)), *others])
        return token

    def _write(self, tokens: Sequence[ListedToken]) -> None:
        wanted = "\n\n".join((_HEAD, *(token.text for token in tokens))) + "\n"
        if read_private(self.file) != wanted.encode():
            write_private(self.file, wanted.encode())

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Keep other processes from changing the list meanwhile."""
        if fcntl is None:
            yield
            return
        lock = self.file.with_suffix(".lock")
        lock.touch(mode=0o600)
        with lock.open("rb") as opened:
            fcntl.flock(opened, fcntl.LOCK_EX)
            yield


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode()).hexdigest()
