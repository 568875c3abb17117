"""The optional libraries of ``--lan``."""

from __future__ import annotations

from typing import Final

NEEDED: Final = "--lan needs the extra lan: pip install 'farsteer[lan]'"
"""What to do where they are missing."""
