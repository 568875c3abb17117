"""What can go wrong; each error's text is one line, fit to be shown to whoever caused it.

RosbridgeError
├── TypeNameError       no such message or service type
├── MessageError        a value that does not fit its type
├── FrameError          a frame that holds no operation
├── OperationError      an operation that cannot be done
├── ServiceError        a service that says no
├── ServiceCallError    a call that got no, or no good, answer
├── ServerError         a server that cannot start
└── ClientError         a connection that cannot be made or used
"""

from __future__ import annotations


class RosbridgeError(Exception):
    """Root of this package's errors."""


class TypeNameError(RosbridgeError, ValueError):
    """No message or service type of this name, or a definition that cannot be read."""


class MessageError(RosbridgeError, ValueError):
    """A value that does not fit its message type."""


class FrameError(RosbridgeError, ValueError):
    """A frame that holds no operation."""


class OperationError(RosbridgeError):
    """An operation that cannot be done, though its frame can be read."""


class ServiceError(RosbridgeError):
    """Raised by a service's handler: the caller is answered ``result: false`` with this text."""


class ServiceCallError(RosbridgeError):
    """A call that was refused, timed out or lost its connection."""


class ServerError(RosbridgeError):
    """A server that cannot start."""


class ClientError(RosbridgeError):
    """A connection that cannot be made, or is used while there is none."""
