"""Token of the operators in the local network: made once, kept, and listed by its digest."""

from __future__ import annotations

import hashlib
import re
import secrets
from pathlib import Path
from typing import Final

from teleop.console.lan.state_files import read_private, write_private
from teleop.errors import SettingError

_TOKEN: Final = re.compile(r"[A-Za-z0-9_-]{16,256}")
_LISTED: Final = """\
# Written by `farsteer serve --lan`; the token itself is in the file {name} beside this one.
[tokens.lan]
role = "operate"
sha256 = "{digest}"
"""


def ensure_token(file: Path, listed: Path) -> str:
    """Return the token, which is made unless it is there, and list its digest for the server.

    Args:
        file: File of the token.
        listed: Token file of the server, which holds the digest of this token only.

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
    digest = hashlib.sha256(token.encode()).hexdigest()
    wanted = _LISTED.format(name=file.name, digest=digest).encode()
    if read_private(listed) != wanted:
        write_private(listed, wanted)
    return token
