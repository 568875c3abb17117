"""Errors of the REST proxy, with the codes that Confluent's documentation gives them."""

from __future__ import annotations

from enum import Enum


class RestError(Exception):
    """A request that fails; it is answered with its status and ``{"error_code": ..., "message": ...}``."""

    def __init__(self, status: int, code: int, message: str) -> None:
        super().__init__(message)
        self.status = status
        """HTTP status."""
        self.code = code
        """Code of the body."""
        self.message = message
        """One line for people."""


class Failure(Enum):
    """Reasons of errors: status, code, and message with a place for what it is about."""

    UNAUTHORIZED = (
        401,
        40101,
        "send the token: Authorization: Bearer TOKEN, or as password of Basic",
    )
    FORBIDDEN = 403, 40301, "{}"
    """A page of another origin, another host's name, or a topic that is not for clients."""
    NO_SUCH_PAGE = 404, 404, "HTTP 404 Not Found"
    NO_TOPIC = 404, 40401, "Topic not found: {:.249}"
    """The topic does not exist and is not made."""
    NO_PARTITION = 404, 40402, "Partition not found: {}"
    NO_CONSUMER = 404, 40403, "Consumer instance not found."
    """There is no consumer of this name, or it has ended."""
    NOT_ACCEPTABLE = 406, 40601, "Accept must allow {}"
    OTHER_FORMAT = (
        *(406, 40601),
        "The requested embedded data format does not match the deserializer for this consumer instance",
    )
    SUBSCRIBED_TWICE = (
        *(409, 40901),
        "Subscription to topics, partitions and pattern are mutually exclusive.",
    )
    CONSUMER_EXISTS = (
        *(409, 40902),
        "Consumer with specified consumer ID already exists in the specified consumer group.",
    )
    UNSUPPORTED_MEDIA_TYPE = 415, 41501, "Content-Type must be {}"
    UNREADABLE = 422, 42201, "Unprocessable body: {}"
    """The body is no JSON of the right shape."""
    BAD_CONSUMER_SETTING = 422, 42204, "Invalid consumer configuration: {}"
    TOO_MANY_CONSUMERS = 429, 42901, "there are {} consumers already; delete one"
    NO_BROKER = 500, 50002, "Kafka error: {}"
    """The broker does not answer, or refuses."""

    def error(self, about: object = "") -> RestError:
        """Return the error, about something."""
        status, code, text = self.value
        return RestError(status, code, text.format(about))
