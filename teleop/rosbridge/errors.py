"""Exceptions of the rosbridge library; the text of each is one line that may be sent to a client.

RosbridgeError
├── TypeNameError       unknown or unreadable message, service or action type
├── MessageError        value that does not fit its type
├── FrameError          frame without a readable operation
├── OperationError      readable operation that is rejected
├── ServiceError        failure reported by a service handler
├── ServiceCallError    service call without a valid response
├── GoalError           goal without a result: GoalRejectedError, GoalLostError
├── ServerError         server that cannot start
└── ClientError         connection that cannot be opened or used
"""

from __future__ import annotations


class RosbridgeError(Exception):
    """Base class of the exceptions of this package."""


class TypeNameError(RosbridgeError, ValueError):
    """The type name is unknown, or its definition cannot be parsed."""


class MessageError(RosbridgeError, ValueError):
    """The value does not fit its message type."""


class FrameError(RosbridgeError, ValueError):
    """The frame does not contain a readable operation."""


class OperationError(RosbridgeError):
    """The operation can be read but is rejected."""


class ServiceError(RosbridgeError):
    """Raised by a service handler; the caller receives ``result: false`` with this text."""


class ServiceCallError(RosbridgeError):
    """The service call was rejected, timed out, or lost its connection."""


class GoalError(RosbridgeError):
    """A goal of an action has no result."""


class GoalRejectedError(GoalError):
    """The goal was never executed, or the action failed without a result."""


class GoalLostError(GoalError):
    """The connection was lost after the goal had been sent; how far it got is unknown."""


class ServerError(RosbridgeError):
    """The server cannot start."""


class ClientError(RosbridgeError):
    """The connection cannot be opened, or is used while it is closed."""
