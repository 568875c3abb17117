"""Opening the page in the user's browser."""

from __future__ import annotations

import os
import threading
import webbrowser

NO_BROWSER = "no browser can be opened from here: open the address yourself"
"""What a person does where there is no screen."""


def open_in_browser(address: str) -> bool:
    """Open an address in the user's browser; return False where there is no screen for one.

    ``$BROWSER`` is obeyed. A browser of the terminal is not opened unless it names one, for it would
    take the terminal. The address is seen by others on this machine, who can list processes.
    """
    screen = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    if not screen and not os.environ.get("BROWSER"):
        return False
    # Some browsers only return when they are closed.
    threading.Thread(target=webbrowser.open, args=(address,), name="browser", daemon=True).start()
    return True
