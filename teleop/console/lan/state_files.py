"""Files in the user's state folder that only the user can read."""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
from pathlib import Path

from teleop.errors import SettingError


def state_folder() -> Path:
    """Return the folder of what is kept: ``$XDG_STATE_HOME/farsteer`` or ``~/.local/state/farsteer``.

    A relative path in the variable is ignored, as the XDG base directory specification demands.
    """
    base = Path(os.environ.get("XDG_STATE_HOME", ""))
    return (base if base.is_absolute() else Path.home() / ".local" / "state") / "farsteer"


def private_folder(folder: Path) -> None:
    """Make a folder that only its owner can enter.

    Raises:
        SettingError: If it cannot be made, or others can enter it.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        mode = folder.stat().st_mode
    except OSError as error:
        raise SettingError(f"cannot make the folder {folder}: {error.strerror}") from None
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise SettingError(f"others can enter {folder}, which holds secrets: chmod 700 {folder}")


def read_private(file: Path) -> bytes | None:
    """Return the content of a file; None if there is no such file.

    Raises:
        SettingError: If it cannot be read, or others can.
    """
    try:
        with file.open("rb") as opened:
            if os.fstat(opened.fileno()).st_mode & (stat.S_IRWXG | stat.S_IRWXO):
                raise SettingError(
                    f"{file} holds a secret but is accessible to others: chmod 600 {file}"
                )
            return opened.read()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise SettingError(f"cannot read {file}: {error.strerror}") from None


def write_private(file: Path, content: bytes, *, replace: bool = True) -> None:
    """Write a file that only its owner can read; it is there as a whole or not at all.

    Args:
        file: The file.
        content: Its content.
        replace: Whether an existing file is replaced; otherwise it stays.

    Raises:
        SettingError: If it cannot be written.
    """
    try:
        handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}")  # mode 0600
        part = Path(name)
        try:
            with os.fdopen(handle, "wb") as opened:
                opened.write(content)
                opened.flush()
                os.fsync(opened.fileno())
            if replace:
                part.replace(file)
            else:
                with contextlib.suppress(FileExistsError):
                    file.hardlink_to(part)  # what another process wrote first stays
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise SettingError(f"cannot write {file}: {error.strerror}") from None
