"""Errors of the REST proxy, with the codes that Confluent's documentation gives them."""

from __future__ import annotations


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


def unauthorized() -> RestError:
    """No token, or a wrong one."""
    return RestError(
        401, 40101, "send the token: Authorization: Bearer TOKEN, or as password of Basic"
    )


def forbidden(message: str) -> RestError:
    """A page of another origin, or another host's name."""
    return RestError(403, 40301, message)


def no_such_page() -> RestError:
    """The interface has no such path."""
    return RestError(404, 404, "HTTP 404 Not Found")


def no_topic(topic: str) -> RestError:
    """The topic does not exist and is not made."""
    return RestError(404, 40401, f"Topic not found: {topic:.249}")


def no_partition(partition: int) -> RestError:
    """The topic has no such partition."""
    return RestError(404, 40402, f"Partition not found: {partition}")


def no_consumer() -> RestError:
    """There is no consumer of this name, or it has ended."""
    return RestError(404, 40403, "Consumer instance not found.")


def not_acceptable(offered: str) -> RestError:
    """The client accepts nothing that can be sent."""
    return RestError(406, 40601, f"Accept must allow {offered}")


def other_format() -> RestError:
    """The records are asked for in another format than the consumer's."""
    return RestError(
        406,
        40601,
        "The requested embedded data format does not match the deserializer for this consumer instance",
    )


def subscribed_twice() -> RestError:
    """Topics and partitions are chosen both by subscription and by hand."""
    return RestError(
        409, 40901, "Subscription to topics, partitions and pattern are mutually exclusive."
    )


def consumer_exists() -> RestError:
    """A consumer of this name is there already."""
    return RestError(
        409,
        40902,
        "Consumer with specified consumer ID already exists in the specified consumer group.",
    )


def unsupported_media_type(offered: str) -> RestError:
    """The body has a media type that cannot be read."""
    return RestError(415, 41501, f"Content-Type must be {offered}")


def unreadable(message: str) -> RestError:
    """The body is no JSON of the right shape."""
    return RestError(422, 42201, f"Unprocessable body: {message}")


def bad_consumer_setting(message: str) -> RestError:
    """The settings of a consumer cannot be followed."""
    return RestError(422, 42204, f"Invalid consumer configuration: {message}")


def too_many_consumers(limit: int) -> RestError:
    """There are as many consumers as there may be."""
    return RestError(429, 42901, f"there are {limit} consumers already; delete one")


def no_broker(message: str) -> RestError:
    """The broker does not answer, or refuses."""
    return RestError(500, 50002, f"Kafka error: {message or 'no answer'}")
