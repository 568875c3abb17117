"""The ``/rosapi`` services, with which clients ask what there is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from teleop.rosbridge.compat.rosapi_typedefs import typedefs
from teleop.rosbridge.errors import ServiceError, TypeNameError
from teleop.rosbridge.graph.parameters import Parameters, read_value, write_value
from teleop.rosbridge.graph.services import Handler
from teleop.rosbridge.graph.subscription import Topic
from teleop.rosbridge.messages.message_completion import stamp
from teleop.rosbridge.messages.message_types import Message, MessageType, short_name
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.topic_names import HOST, canonical

_TYPES: Final = {
    "rosapi_msgs/TypeDef": (
        "string type\nstring[] fieldnames\nstring[] fieldtypes\nint32[] fieldarraylen\n"
        "string[] examples\nstring[] constnames\nstring[] constvalues"
    ),
}

_DEFS: Final = "string type\n---\nrosapi_msgs/TypeDef[] typedefs"
_DONE: Final = "bool successful\nstring reason"
"""What newer servers tell of parameters; older clients ignore it."""

_SERVICES: Final = {
    "topics": ("Topics", "---\nstring[] topics\nstring[] types"),
    "topic_type": ("TopicType", "string topic\n---\nstring type"),
    "topics_for_type": ("TopicsForType", "string type\n---\nstring[] topics"),
    "topics_and_raw_types": (
        "TopicsAndRawTypes",
        "---\nstring[] topics\nstring[] types\nstring[] typedefs_full_text",
    ),
    "services": ("Services", "---\nstring[] services"),
    "service_type": ("ServiceType", "string service\n---\nstring type"),
    "services_for_type": ("ServicesForType", "string type\n---\nstring[] services"),
    "service_node": ("ServiceNode", "string service\n---\nstring node"),
    "service_providers": ("ServiceProviders", "string service\n---\nstring[] providers"),
    "service_request_details": ("ServiceRequestDetails", _DEFS),
    "service_response_details": ("ServiceResponseDetails", _DEFS),
    "message_details": ("MessageDetails", _DEFS),
    "action_servers": ("GetActionServers", "---\nstring[] action_servers"),
    "action_type": ("ActionType", "string action\n---\nstring type"),
    "action_goal_details": ("ActionGoalDetails", _DEFS),
    "action_result_details": ("ActionResultDetails", _DEFS),
    "action_feedback_details": ("ActionFeedbackDetails", _DEFS),
    "interfaces": ("Interfaces", "---\nstring[] interfaces"),
    "nodes": ("Nodes", "---\nstring[] nodes"),
    "node_details": (
        "NodeDetails",
        "string node\n---\nstring[] subscribing\nstring[] publishing\nstring[] services",
    ),
    "publishers": ("Publishers", "string topic\n---\nstring[] publishers"),
    "subscribers": ("Subscribers", "string topic\n---\nstring[] subscribers"),
    "get_param": (
        "GetParam",
        f"string name\nstring default\nstring default_value\n---\nstring value\n{_DONE}",
    ),
    "set_param": ("SetParam", f"string name\nstring value\n---\n{_DONE}"),
    "delete_param": ("DeleteParam", f"string name\n---\n{_DONE}"),
    "has_param": ("HasParam", "string name\n---\nbool exists"),
    "search_param": ("SearchParam", "string name\n---\nstring global_name"),
    "get_param_names": ("GetParamNames", "---\nstring[] names"),
    "get_time": ("GetTime", "---\nbuiltin_interfaces/Time time"),
    "get_ros_version": ("GetROSVersion", "---\nuint8 version\nstring distro"),
}

_NODE: Final = "/rosbridge_websocket"
"""What the program that runs the server is called among nodes, as in rosbridge_suite."""

_SOURCES: Final = ("goal", "cancel", "status", "feedback", "result")
"""Topics of an actionlib server."""


def serve_rosapi(
    protocol: Protocol,
    *,
    names: Callable[[str], str] | None = None,
    distro: str | None = None,
    parameters: Parameters | None = None,
) -> None:
    """Offer the services of ``/rosapi``.

    Args:
        protocol: Gets the services, and the types they need.
        names: Writes the types of topics, services and actions; by default as the protocol's flavour
            does, ``pkg/Type`` in ROS 1 and ``pkg/msg/Type`` in ROS 2. The parts of a type are told as
            ``pkg/Type`` in either, as rosapi does.
        distro: The ROS that is claimed to run here; jazzy or noetic by the protocol's flavour.
        parameters: What clients may read and write; a fresh set with ``rosdistro`` by default.
    """
    for name, text in _TYPES.items():
        protocol.registry.add(name, text)
    distro = distro or ("noetic" if protocol.flavour == "ros1" else "jazzy")
    if parameters is None:
        parameters = Parameters()
        parameters.set("rosdistro", distro)
    if names is None:
        names = short_name if protocol.flavour == "ros1" else str
    api = _Api(protocol, names, distro, parameters)
    for service, (kind, text) in _SERVICES.items():
        protocol.registry.add_service(f"rosapi_msgs/{kind}", text)
        protocol.serve(f"/rosapi/{service}", f"rosapi_msgs/{kind}", api.handler(service))


class _Api:
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
        act: Callable[[Message, int], Message] = getattr(self, service)
        return lambda client, request, now: act(request, now)

    # Topics

    def topics(self, request: Message, now: int) -> Message:
        topics = self._topics()
        return {
            "topics": [topic.name for topic in topics],
            "types": [self._names(topic.kind.name) for topic in topics],
        }

    def topic_type(self, request: Message, now: int) -> Message:
        topic = self._topic(request["topic"])
        return {"type": self._names(topic.kind.name) if topic else ""}

    def topics_for_type(self, request: Message, now: int) -> Message:
        try:
            wanted = self._registry.resolve(request["type"])
        except TypeNameError:
            return {"topics": []}
        return {"topics": [topic.name for topic in self._topics() if topic.kind.name == wanted]}

    def topics_and_raw_types(self, request: Message, now: int) -> Message:
        raw = self._protocol.encoders.raw(self._protocol.flavour)
        texts = [raw.definition(topic.kind) for topic in self._topics()]
        return {**self.topics(request, now), "typedefs_full_text": texts}

    def publishers(self, request: Message, now: int) -> Message:
        topic = self._topic(request["topic"])
        return {"publishers": _publishers(topic) if topic else []}

    def subscribers(self, request: Message, now: int) -> Message:
        topic = self._topic(request["topic"])
        return {"subscribers": _subscribers(topic) if topic else []}

    def _topics(self) -> list[Topic]:
        return sorted(self._protocol.topics, key=lambda topic: topic.name)

    def _topic(self, name: str) -> Topic | None:
        wanted = canonical(name)
        return next((topic for topic in self._protocol.topics if topic.name == wanted), None)

    # Services

    def services(self, request: Message, now: int) -> Message:
        return {"services": sorted(service.name for service in self._protocol.services)}

    def service_type(self, request: Message, now: int) -> Message:
        wanted = canonical(request["service"])
        found = [s.kind.name for s in self._protocol.services if s.name == wanted]
        return {"type": self._names(found[0]) if found else ""}

    def services_for_type(self, request: Message, now: int) -> Message:
        try:
            wanted = self._registry.resolve_service(request["type"])
        except TypeNameError:
            return {"services": []}
        services = self._protocol.services
        return {"services": sorted(s.name for s in services if s.kind.name == wanted)}

    def service_node(self, request: Message, now: int) -> Message:
        wanted = canonical(request["service"])
        found = [s.provider for s in self._protocol.services if s.name == wanted]
        return {"node": _node(found[0]) if found else ""}

    def service_providers(self, request: Message, now: int) -> Message:
        """Return who provides a service by this name, or services of this type: both are asked."""
        name = request["service"]
        try:
            kind = self._registry.resolve_service(name)
        except TypeNameError:
            kind = ""
        found = {
            _node(service.provider)
            for service in self._protocol.services
            if service.name == canonical(name) or service.kind.name == kind
        }
        return {"providers": sorted(found)}

    # Types

    def message_details(self, request: Message, now: int) -> Message:
        return self._details(lambda name: self._registry[name], request)

    def service_request_details(self, request: Message, now: int) -> Message:
        return self._details(lambda name: self._registry.service(name).request, request)

    def service_response_details(self, request: Message, now: int) -> Message:
        return self._details(lambda name: self._registry.service(name).response, request)

    def action_goal_details(self, request: Message, now: int) -> Message:
        return self._details(lambda name: self._registry.action(name).goal, request)

    def action_result_details(self, request: Message, now: int) -> Message:
        return self._details(lambda name: self._registry.action(name).result, request)

    def action_feedback_details(self, request: Message, now: int) -> Message:
        return self._details(lambda name: self._registry.action(name).feedback, request)

    def interfaces(self, request: Message, now: int) -> Message:
        return {"interfaces": sorted(map(self._names, self._registry))}

    def _details(self, find: Callable[[str], MessageType], request: Message) -> Message:
        try:
            root = find(request["type"])
        except TypeNameError as error:
            raise ServiceError(str(error)) from error
        return {"typedefs": typedefs(self._registry, root)}

    # Actions: those of ROS 2, and of actionlib what looks like a server by its topics

    def action_servers(self, request: Message, now: int) -> Message:
        topics = {topic.name for topic in self._protocol.topics}
        found = {action.name for action in self._protocol.actions}
        for topic in topics:
            name, _, last = topic.rpartition("/")
            if last == "goal" and name and all(f"{name}/{end}" in topics for end in _SOURCES):
                found.add(name)
        return {"action_servers": sorted(found)}

    def action_type(self, request: Message, now: int) -> Message:
        wanted = canonical(request["action"])
        found = [a.kind.name for a in self._protocol.actions if a.name == wanted]
        return {"type": self._names(found[0]) if found else ""}

    # Nodes: this program, and each client

    def nodes(self, request: Message, now: int) -> Message:
        return {"nodes": [_NODE, *(_node(client) for client in self._protocol.clients)]}

    def node_details(self, request: Message, now: int) -> Message:
        node = canonical(request["node"])
        topics = self._topics()
        services = self._protocol.services
        return {
            "subscribing": [topic.name for topic in topics if node in _subscribers(topic)],
            "publishing": [topic.name for topic in topics if node in _publishers(topic)],
            "services": sorted(s.name for s in services if _node(s.provider) == node),
        }

    # Parameters

    def get_param(self, request: Message, now: int) -> Message:
        value = self._parameters.get(request["name"])
        if value is None:
            otherwise = request["default"] or request["default_value"]
            found = write_value(read_value(otherwise)) if otherwise else "null"
            return {"value": found, "successful": False, "reason": "it is not set"}
        return {"value": write_value(value), "successful": True}

    def set_param(self, request: Message, now: int) -> Message:
        self._parameters.set(request["name"], read_value(request["value"]))
        return {"successful": True}

    def delete_param(self, request: Message, now: int) -> Message:
        gone = self._parameters.delete(request["name"])
        return {"successful": gone, "reason": "" if gone else "it is not set"}

    def has_param(self, request: Message, now: int) -> Message:
        return {"exists": self._parameters.get(request["name"]) is not None}

    def search_param(self, request: Message, now: int) -> Message:
        name = canonical(request["name"])
        return {"global_name": name if self._parameters.get(name) is not None else ""}

    def get_param_names(self, request: Message, now: int) -> Message:
        return {"names": self._parameters.names}

    # The rest

    def get_time(self, request: Message, now: int) -> Message:
        return {"time": stamp(now)}

    def get_ros_version(self, request: Message, now: int) -> Message:
        return {"version": 1 if self._protocol.flavour == "ros1" else 2, "distro": self._distro}


def _node(client: int) -> str:
    return _NODE if client == HOST else f"/client_{client}"


def _publishers(topic: Topic) -> list[str]:
    return [_NODE] * topic.owned + [_node(client) for client in topic.advertisers]


def _subscribers(topic: Topic) -> list[str]:
    heard = bool(topic.listener or topic.taps)
    return [_NODE] * heard + [_node(client) for client in topic.subscriptions]
