"""QR code of an address, as text for a terminal and as a picture."""

from __future__ import annotations

import io
from typing import Final

from localization.extras import require

_COLOURS: Final = "\x1b[97;40m"
_END: Final = "\x1b[0m"


def qr_text(address: str) -> str:
    """Return the QR code of an address, two modules in each character, with its quiet zone.

    The colours are set, light modules white on black, so that the code is right on dark and on light terminals.

    Raises:
        MissingLibraryError: If the library is missing.
    """
    require("segno", "--lan")
    import segno

    out = io.StringIO()
    segno.make_qr(address, error="m").terminal(out, border=2, compact=True)
    return "\n".join(f"{_COLOURS}{line}{_END}" for line in out.getvalue().splitlines())


def qr_picture(address: str) -> str:
    """Return the QR code of an address as a picture's own address, ``data:image/svg+xml``, dark on white.

    Raises:
        MissingLibraryError: If the library is missing.
    """
    require("segno", "--lan")
    import segno

    picture: str = segno.make_qr(address, error="m").svg_data_uri(light="white", scale=6)
    return picture
