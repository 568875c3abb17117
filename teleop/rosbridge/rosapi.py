"""The ``/rosapi`` services, with which clients ask what there is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from teleop.rosbridge.errors import ServiceError, TypeNameError
from teleop.rosbridge.messages import default_value, stamp
from teleop.rosbridge.names import canonical
from teleop.rosbridge.protocol import Protocol
from teleop.rosbridge.registry import Registry
from teleop.rosbridge.services import Handler
from teleop.rosbridge.types import Field, Message, MessageType, short_name

_TYPES: Final = {
    "rosapi_msgs/TypeDef": (
        "string type\nstring[] fieldnames\nstring[] fieldtypes\nint32[] fieldarraylen\n"
        "string[] examples\nstring[] constnames\nstring[] constvalues"
    ),
}

_SERVICES: Final = {
    "topics": ("Topics", "---\nstring[] topics\nstring[] types"),
    "topic_type": ("TopicType", "string topic\n---\nstring type"),
    "topics_for_type": ("TopicsForType", "string type\n---\nstring[] topics"),
    "services": ("Services", "---\nstring[] services"),
    "service_type": ("ServiceType", "string service\n---\nstring type"),
    "services_for_type": ("ServicesForType", "string type\n---\nstring[] services"),
    "nodes": ("Nodes", "---\nstring[] nodes"),
    "get_time": ("GetTime", "---\nbuiltin_interfaces/Time time"),
    "get_ros_version": ("GetROSVersion", "---\nuint8 version\nstring distro"),
    "message_details": ("MessageDetails", "string type\n---\nrosapi_msgs/TypeDef[] typedefs"),
}

_NODE: Final = "/rosbridge_websocket"


def serve_rosapi(
    protocol: Protocol, *, names: Callable[[str], str] = short_name, distro: str = "jazzy"
) -> None:
    """Offer the services of ``/rosapi`` that clients use.

    Args:
        protocol: Gets the services, and the types they need.
        names: Writes the names of types in answers; ``pkg/Type`` by default, which all clients know.
        distro: The ROS that is claimed to run here.
    """
    for name, text in _TYPES.items():
        protocol.registry.add(name, text)
    api = _Api(protocol, names, distro)
    for service, (kind, text) in _SERVICES.items():
        protocol.registry.add_service(f"rosapi_msgs/{kind}", text)
        protocol.serve(f"/rosapi/{service}", f"rosapi_msgs/{kind}", api.handler(service))


class _Api:
    def __init__(self, protocol: Protocol, names: Callable[[str], str], distro: str) -> None:
        self._protocol = protocol
        self._names = names
        self._distro = distro

    def handler(self, service: str) -> Handler:
        act: Callable[[Message, int], Message] = getattr(self, service)
        return lambda client, request, now: act(request, now)

    def topics(self, request: Message, now: int) -> Message:
        topics = sorted(self._protocol.topics, key=lambda topic: topic.name)
        return {
            "topics": [topic.name for topic in topics],
            "types": [self._names(topic.kind.name) for topic in topics],
        }

    def topic_type(self, request: Message, now: int) -> Message:
        wanted = canonical(request["topic"])
        found = [t.kind.name for t in self._protocol.topics if t.name == wanted]
        return {"type": self._names(found[0]) if found else ""}

    def topics_for_type(self, request: Message, now: int) -> Message:
        topics = self._protocol.topics
        try:
            wanted = self._protocol.registry.resolve(request["type"])
        except TypeNameError:
            return {"topics": []}
        return {"topics": sorted(topic.name for topic in topics if topic.kind.name == wanted)}

    def services(self, request: Message, now: int) -> Message:
        return {"services": sorted(service.name for service in self._protocol.services)}

    def service_type(self, request: Message, now: int) -> Message:
        wanted = canonical(request["service"])
        found = [s.kind.name for s in self._protocol.services if s.name == wanted]
        return {"type": self._names(found[0]) if found else ""}

    def services_for_type(self, request: Message, now: int) -> Message:
        services = self._protocol.services
        try:
            wanted = self._protocol.registry.resolve_service(request["type"])
        except TypeNameError:
            return {"services": []}
        return {"services": sorted(s.name for s in services if s.kind.name == wanted)}

    def nodes(self, request: Message, now: int) -> Message:
        return {"nodes": [_NODE]}

    def get_time(self, request: Message, now: int) -> Message:
        return {"time": stamp(now)}

    def get_ros_version(self, request: Message, now: int) -> Message:
        return {"version": 2, "distro": self._distro}

    def message_details(self, request: Message, now: int) -> Message:
        registry = self._protocol.registry
        try:
            root = registry[request["type"]]
        except TypeNameError as error:
            raise ServiceError(str(error)) from error
        found: dict[str, MessageType] = {}
        _collect(registry, root, found)
        return {"typedefs": [self._typedef(kind) for kind in found.values()]}

    def _typedef(self, kind: MessageType) -> Message:
        return {
            "type": self._names(kind.name),
            "fieldnames": [field.name for field in kind.fields],
            "fieldtypes": [self._field_type(field) for field in kind.fields],
            # rosapi's code for the length: -1 for a single value, 0 for a sequence.
            "fieldarraylen": [field.size if field.repeated else -1 for field in kind.fields],
            "examples": [self._example(kind, field) for field in kind.fields],
            "constnames": [name for name, _ in kind.constants],
            "constvalues": [value for _, value in kind.constants],
        }

    def _field_type(self, field: Field) -> str:
        return self._names(field.kind) if field.nested else field.kind

    def _example(self, kind: MessageType, field: Field) -> str:
        if field.repeated:
            return "[]"
        if field.nested:
            return "{}"
        return str(default_value(self._protocol.registry, kind, field))


def _collect(registry: Registry, kind: MessageType, found: dict[str, MessageType]) -> None:
    """Add a type and those it is made of, itself first."""
    if kind.name not in found:
        found[kind.name] = kind
        for field in kind.fields:
            if field.nested:
                _collect(registry, registry[field.kind], found)
