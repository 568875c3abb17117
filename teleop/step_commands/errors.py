"""Error of step commands that cannot be followed."""

from __future__ import annotations

from teleop.errors import TeleopError


class StepCommandError(TeleopError, ValueError):
    """A step command is invalid; the message names the field, and what would have worked."""
