"""Token file that is reloaded when it changes, by a thread, so that no slow disk blocks the server."""

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
"""Time between two checks of the file [s]."""

_Signature: TypeAlias = tuple[int, ...] | None
"""File attributes that change with the file; None if it does not exist."""


class TokenFile:
    """A token file with its credentials, and the detection of changes."""

    def __init__(
        self,
        path: Path,
        wall: Callable[[], float],
        rules: Mapping[Role, RoleRules] = DEFAULT_RULES,
    ) -> None:
        """Read the file; see ``read_credentials``, also for the exceptions.

        Args:
            path: The file.
            wall: Returns the Unix time [s], by which tokens end.
            rules: Rules of each role, unless the file changes them.
        """
        self._path, self._wall, self._rules = path, wall, rules
        self._read = self._seen = self._signature()
        self.credentials = read_credentials(path, rules).valid_at(wall())
        """Credentials of the last valid version of the file, as far as they are valid still."""

    def poll(self, *, immediately: bool = False) -> Credentials | None:
        """Return the new credentials if the file has changed, and not since the last check, or if some have ended.

        The latter avoids reading a file that is still being written, unless ``immediately`` is set.
        For an invalid file an error is logged once, and the previous credentials remain valid.
        """
        signature = self._signature()
        steady, self._seen = signature == self._seen, signature
        if signature == self._read or not (steady or immediately):
            left = self.credentials.valid_at(self._wall())
            ended = len(left.keys) < len(self.credentials.keys)
            self.credentials = left
            return left if ended else None
        self._read = signature
        try:
            read = read_credentials(self._path, self._rules)
        except ServerError as error:
            _LOG.error("%s; the previous tokens remain valid", error)
            return None
        self.credentials = read.valid_at(self._wall())
        return self.credentials

    def _signature(self) -> _Signature:
        try:
            found = self._path.stat()
        except OSError:
            return None
        return (
            *(found.st_mtime_ns, found.st_ctime_ns, found.st_size),
            *(found.st_ino, found.st_dev, found.st_mode),
        )


class TokenWatch:
    """Thread that reloads a token file when it changes, until it is closed."""

    def __init__(
        self,
        file: TokenFile,
        changed: Callable[[Credentials], object],
        *,
        interval: float = _INTERVAL,
    ) -> None:
        """Start; ``changed`` is called in this thread, ``interval`` is in [s]."""
        self._file = file
        self._changed = changed
        self._interval = interval
        self._wake = threading.Event()
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name="tokens", daemon=True)
        self._thread.start()

    def check_now(self) -> None:
        """Check the file at once."""
        self._wake.set()

    def close(self) -> None:
        """Stop the thread."""
        self._stopping = True
        self._wake.set()
        self._thread.join(self._interval)  # if the disk hangs, it ends with the program

    def _run(self) -> None:
        while True:
            immediately = self._wake.wait(self._interval)
            self._wake.clear()
            if self._stopping:
                return
            if (credentials := self._file.poll(immediately=immediately)) is not None:
                self._changed(credentials)
