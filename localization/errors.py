"""Base class of the errors that this package raises."""


class LocalizationError(ValueError):
    """An input that cannot be used; the message is one line and names what would work."""
