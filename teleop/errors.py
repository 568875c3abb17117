"""Base error of the teleop package, and the error for settings."""

from __future__ import annotations


class TeleopError(Exception):
    """Base of all errors that ``teleop`` raises for its user to correct; the message is one line."""


class SettingError(TeleopError):
    """A setting is out of its range, or contradicts another one; the message names it.

    It is no ``ValueError``, which tyro would report as a failure to parse the command line.
    """
