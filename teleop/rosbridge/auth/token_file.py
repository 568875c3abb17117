"""A file of tokens that is read again when it changes, by a thread of its own: no disk holds up the rest."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, TypeAlias

from teleop.rosbridge.auth.credentials import Credentials, read_credentials
from teleop.rosbridge.auth.permissions import DEFAULT_RULES, Role, RoleRules
from teleop.rosbridge.errors import ServerError

_LOG: Final = logging.getLogger(__name__)

_INTERVAL: Final = 1.0
"""Time between two looks at the file [s]."""

_Look: TypeAlias = tuple[int, ...] | None
"""What changes when a file does; None if there is none."""


class TokenFile:
    """What a file of tokens says, and whether it says something else now."""

    def __init__(self, path: Path, rules: Mapping[Role, RoleRules] = DEFAULT_RULES) -> None:
        """Read the file; see ``read_credentials``, also for what is raised."""
        self._path = path
        self._rules = rules
        self._read = self._seen = self._look()
        self.keyring = read_credentials(path, rules)
        """What it said when it was good last."""

    def poll(self, *, hurry: bool = False) -> Credentials | None:
        """Return what the file says if it has changed since, and is as it was at the last look.

        So no file is read that is still being written, unless one is in a hurry. A file that cannot
        be used is complained of once, and what was read before holds.
        """
        look = self._look()
        steady, self._seen = look == self._seen, look
        if look == self._read or not (steady or hurry):
            return None
        self._read = look
        try:
            self.keyring = read_credentials(self._path, self._rules)
        except ServerError as error:
            _LOG.error("%s; the tokens that were read before hold", error)
            return None
        return self.keyring

    def _look(self) -> _Look:
        try:
            found = self._path.stat()
        except OSError:
            return None
        return (
            *(found.st_mtime_ns, found.st_ctime_ns, found.st_size),
            *(found.st_ino, found.st_dev, found.st_mode),
        )


class TokenWatch:
    """Looks at a file of tokens again and again until it is closed."""

    def __init__(
        self,
        file: TokenFile,
        renewed: Callable[[Credentials], object],
        *,
        interval: float = _INTERVAL,
    ) -> None:
        """Begin; ``renewed`` is called in this watch's thread, ``interval`` is in [s]."""
        self._file = file
        self._renewed = renewed
        self._interval = interval
        self._wake = threading.Event()
        self._ends = False
        self._thread = threading.Thread(target=self._run, name="tokens", daemon=True)
        self._thread.start()

    def hurry(self) -> None:
        """Look at once."""
        self._wake.set()

    def close(self) -> None:
        """Look no more."""
        self._ends = True
        self._wake.set()
        self._thread.join(self._interval)  # if the disk hangs, it ends with the program

    def _run(self) -> None:
        while True:
            hurry = self._wake.wait(self._interval)
            self._wake.clear()
            if self._ends:
                return
            if (fresh := self._file.poll(hurry=hurry)) is not None:
                self._renewed(fresh)
