"""Handlers of the ``/rosapi`` services."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from teleop.rosbridge.compat.rosapi_typedefs import typedefs
from teleop.rosbridge.errors import ServiceError, TypeNameError
from teleop.rosbridge.graph.parameters import Parameters, read_value, write_value
from teleop.rosbridge.graph.services import Handler
from teleop.rosbridge.graph.topic import Topic
from teleop.rosbridge.messages.message_types import Message, MessageType
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.ros_time import stamp
from teleop.rosbridge.topic_names import HOST, canonical

_NODE: Final = "/rosbridge_websocket"
"""Name of the node that represents the server, as in rosbridge_suite."""

_ACTIONLIB_TOPICS: Final = ("goal", "cancel", "status", "feedback", "result")
"""Topics of an actionlib server."""

_DETAILS: Final[dict[str, Callable[[TypeRegistry, str], MessageType]]] = {
    "message_details": lambda registry, name: registry[name],
    "service_request_details": lambda registry, name: registry.service(name).request,
    "service_response_details": lambda registry, name: registry.service(name).response,
    "action_goal_details": lambda registry, name: registry.action(name).goal,
    "action_result_details": lambda registry, name: registry.action(name).result,
    "action_feedback_details": lambda registry, name: registry.action(name).feedback,
}
"""Services that return the definition of a type."""


class RosapiHandlers:
    """Handlers of the ``/rosapi`` services; each method has the name of its service."""

    def __init__(
        self,
        protocol: Protocol,
        names: Callable[[str], str],
        distro: str,
        parameters: Parameters,
    ) -> None:
        self._protocol = protocol
        self._registry = protocol.registry
        self._names = names
        self._distro = distro
        self._parameters = parameters

    def handler(self, service: str) -> Handler:
        """Return the handler of a service."""
        if (part := _DETAILS.get(service)) is not None:
            return lambda client, request, now: self._details(part, request)
        method: Callable[[Message, int], Message] = getattr(self, service)
        return lambda client, request, now: method(request, now)

    # Topics

    def topics(self, request: Message, now: int) -> Message:
        """Return all topics and their types."""
        topics = self._topics()
        return {
            "topics": [topic.name for topic in topics],
            "types": [self._names(topic.kind.name) for topic in topics],
        }

    def topic_type(self, request: Message, now: int) -> Message:
        """Return the type of a topic."""
        topic = self._protocol.topics.find(request["topic"])
        return {"type": self._names(topic.kind.name) if topic else ""}

    def topics_for_type(self, request: Message, now: int) -> Message:
        """Return the topics of a type."""
        try:
            wanted = self._registry.resolve(request["type"])
        except TypeNameError:
            return {"topics": []}
        return {"topics": [topic.name for topic in self._topics() if topic.kind.name == wanted]}

    def topics_and_raw_types(self, request: Message, now: int) -> Message:
        """Return all topics with types and definitions."""
        serializer = self._protocol.encoders.serializers[self._protocol.ros_version]
        texts = [serializer.definition(topic.kind) for topic in self._topics()]
        return {**self.topics(request, now), "typedefs_full_text": texts}

    def publishers(self, request: Message, now: int) -> Message:
        """Return the publishing nodes of a topic."""
        topic = self._protocol.topics.find(request["topic"])
        return {"publishers": _publishers(topic) if topic else []}

    def subscribers(self, request: Message, now: int) -> Message:
        """Return the subscribing nodes of a topic."""
        topic = self._protocol.topics.find(request["topic"])
        return {"subscribers": _subscribers(topic) if topic else []}

    def _topics(self) -> list[Topic]:
        return sorted(self._protocol.topics.all, key=lambda topic: topic.name)

    # Services

    def services(self, request: Message, now: int) -> Message:
        """Return all services."""
        return {"services": sorted(service.name for service in self._protocol.services.all)}

    def service_type(self, request: Message, now: int) -> Message:
        """Return the type of a service."""
        service = self._protocol.services.find(request["service"])
        return {"type": self._names(service.kind.name) if service else ""}

    def services_for_type(self, request: Message, now: int) -> Message:
        """Return the services of a type."""
        try:
            wanted = self._registry.resolve_service(request["type"])
        except TypeNameError:
            return {"services": []}
        services = self._protocol.services.all
        return {"services": sorted(s.name for s in services if s.kind.name == wanted)}

    def service_node(self, request: Message, now: int) -> Message:
        """Return the node that provides a service."""
        service = self._protocol.services.find(request["service"])
        return {"node": _node(service.provider) if service else ""}

    def service_providers(self, request: Message, now: int) -> Message:
        """Return the providers of a service of this name, and of services of this type."""
        name = request["service"]
        try:
            kind = self._registry.resolve_service(name)
        except TypeNameError:
            kind = ""
        found = {
            _node(service.provider)
            for service in self._protocol.services.all
            if service.name == canonical(name) or service.kind.name == kind
        }
        return {"providers": sorted(found)}

    # Types

    def interfaces(self, request: Message, now: int) -> Message:
        """Return all message types."""
        return {"interfaces": sorted(map(self._names, self._registry))}

    def _details(
        self, part: Callable[[TypeRegistry, str], MessageType], request: Message
    ) -> Message:
        try:
            root = part(self._registry, request["type"])
        except TypeNameError as error:
            raise ServiceError(str(error)) from error
        return {"typedefs": typedefs(self._registry, root)}

    # Actions: those of ROS 2, and actionlib servers by their topics

    def action_servers(self, request: Message, now: int) -> Message:
        """Return all action servers."""
        topics = {topic.name for topic in self._protocol.topics.all}
        found = {action.name for action in self._protocol.actions.all}
        for topic in topics:
            name, _, last = topic.rpartition("/")
            if (
                last == "goal"
                and name
                and all(f"{name}/{end}" in topics for end in _ACTIONLIB_TOPICS)
            ):
                found.add(name)
        return {"action_servers": sorted(found)}

    def action_type(self, request: Message, now: int) -> Message:
        """Return the type of an action."""
        action = self._protocol.actions.find(request["action"])
        return {"type": self._names(action.kind.name) if action else ""}

    # Nodes: this program and each client

    def nodes(self, request: Message, now: int) -> Message:
        """Return all nodes."""
        return {
            "nodes": [_NODE, *(_node(connection.id) for connection in self._protocol.connections)]
        }

    def node_details(self, request: Message, now: int) -> Message:
        """Return topics and services of a node."""
        node = canonical(request["node"])
        topics = self._topics()
        services = self._protocol.services.all
        return {
            "subscribing": [topic.name for topic in topics if node in _subscribers(topic)],
            "publishing": [topic.name for topic in topics if node in _publishers(topic)],
            "services": sorted(s.name for s in services if _node(s.provider) == node),
        }

    # Parameters

    def get_param(self, request: Message, now: int) -> Message:
        """Return the value of a parameter as JSON text."""
        value = self._parameters.get(request["name"])
        if value is None:
            fallback = request["default"] or request["default_value"]
            found = write_value(read_value(fallback)) if fallback else "null"
            return {"value": found, "successful": False, "reason": "the parameter is not set"}
        return {"value": write_value(value), "successful": True}

    def set_param(self, request: Message, now: int) -> Message:
        """Set a parameter to the value of a JSON text."""
        self._parameters.set(request["name"], read_value(request["value"]))
        return {"successful": True}

    def delete_param(self, request: Message, now: int) -> Message:
        """Delete a parameter."""
        gone = self._parameters.delete(request["name"])
        return {"successful": gone, "reason": "" if gone else "the parameter is not set"}

    def has_param(self, request: Message, now: int) -> Message:
        """Return whether a parameter is set."""
        return {"exists": self._parameters.get(request["name"]) is not None}

    def search_param(self, request: Message, now: int) -> Message:
        """Return the full name of a parameter."""
        name = canonical(request["name"])
        return {"global_name": name if self._parameters.get(name) is not None else ""}

    def get_param_names(self, request: Message, now: int) -> Message:
        """Return the names of all parameters."""
        return {"names": self._parameters.names}

    # Time and version

    def get_time(self, request: Message, now: int) -> Message:
        """Return the protocol's time."""
        return {"time": stamp(now)}

    def get_ros_version(self, request: Message, now: int) -> Message:
        """Return ROS version and distribution."""
        return {"version": 1 if self._protocol.ros_version == "ros1" else 2, "distro": self._distro}


def _node(client: int) -> str:
    return _NODE if client == HOST else f"/client_{client}"


def _publishers(topic: Topic) -> list[str]:
    return [_NODE] * topic.owned + [_node(client) for client in topic.advertisers]


def _subscribers(topic: Topic) -> list[str]:
    subscribed = bool(topic.handler or topic.monitors)
    return [_NODE] * subscribed + [_node(client) for client in topic.subscriptions]
