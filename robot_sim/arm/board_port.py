"""The board of a second arm behind a serial port of this machine, as if it were plugged in: a pseudo-terminal."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import tty
from collections.abc import Callable
from pathlib import Path
from typing import Final, Self

from robot_sim.arm.servo_board import ServoBoard
from robot_sim.errors import ArmError

BUFFER: Final = 64
"""Characters that the receive buffer of an Uno holds; who writes faster than the line has to wait."""

_STEP: Final = 0.004  # longest wait [s], a fifth of a frame
_LARGEST_LAG: Final = 100_000_000  # time that is caught up with after a pause of the process [ns]


class BoardPort:
    """A pseudo-terminal. Owns its two ends and the link to it."""

    def __init__(self, link: Path | None = None) -> None:
        """Open it.

        Args:
            link: Symbolic link to make, a name that stays when the board is plugged in again; None for none.

        Raises:
            ArmError: If something else has the link's name, or it cannot be made.
        """
        self._link = link
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.name = os.ttyname(self._slave)
        """The device's name, as ``/dev/pts/3``."""
        if link is not None:
            try:
                self._make(link)
            except ArmError:
                self.close()
                raise

    def _make(self, link: Path) -> None:
        try:
            if link.is_symlink():
                link.unlink()
            link.symlink_to(self.name)
        except OSError as error:
            raise ArmError(
                f"link {link}: {error.strerror}; name a file that is not there"
            ) from None

    def close(self) -> None:
        """Unplug the board: who has the port open finds it hung up."""
        os.close(self._master)
        os.close(self._slave)
        if self._link is not None:
            with contextlib.suppress(OSError):
                if self._link.readlink() == Path(self.name):
                    self._link.unlink()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()

    def read(self, most: int, wait: float) -> bytes:
        """Return up to ``most`` characters that were written to the port, and wait for the first of them [s]."""
        ready, _, _ = select.select([self._master] if most > 0 else [], [], [], wait)
        return os.read(self._master, most) if ready else b""

    def write(self, data: bytes) -> None:
        """Send; what nobody reads is lost, as on a wire."""
        with contextlib.suppress(BlockingIOError):
            while data:
                data = data[os.write(self._master, data) :]


def run_board(
    board: ServoBoard, port: BoardPort, now: Callable[[], int], ended: Callable[[], bool]
) -> None:
    """Run a board in real time until ``ended`` says so.

    Args:
        board: The board.
        port: Its port.
        now: A monotonic clock [ns].
        ended: Called some hundred times a second.
    """
    last = now()
    while not ended():
        board.take(port.read(BUFFER - board.waiting, _STEP))
        time = now()
        port.write(board.advance(min(time - last, _LARGEST_LAG)))
        last = time
