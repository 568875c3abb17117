"""The ``/rosapi`` services, by which clients query the ROS graph."""

from __future__ import annotations

from typing import Final

from teleop.rosbridge.compat.rosapi_handlers import RosapiHandlers
from teleop.rosbridge.graph.parameters import Parameters
from teleop.rosbridge.messages.message_types import short_name
from teleop.rosbridge.protocol.protocol import Protocol

_TYPES: Final = {
    "rosapi_msgs/TypeDef": (
        "string type\nstring[] fieldnames\nstring[] fieldtypes\nint32[] fieldarraylen\n"
        "string[] examples\nstring[] constnames\nstring[] constvalues"
    ),
}

_DEFS: Final = "string type\n---\nrosapi_msgs/TypeDef[] typedefs"
_DONE: Final = "bool successful\nstring reason"
"""Fields of newer servers; older clients ignore them."""

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


def serve_rosapi(protocol: Protocol) -> None:
    """Provide the services of ``/rosapi``, as jazzy or noetic.

    Types of topics, services and actions are named as the protocol's ROS version does, ``pkg/Type`` in ROS 1 and
    ``pkg/msg/Type`` in ROS 2; types of fields are always ``pkg/Type``, as in the original rosapi.
    """
    for name, text in _TYPES.items():
        protocol.registry.add(name, text)
    is_ros1 = protocol.ros_version == "ros1"
    names, distro = (short_name, "noetic") if is_ros1 else (str, "jazzy")
    parameters = Parameters()
    parameters.set("rosdistro", distro)
    handlers = RosapiHandlers(protocol, names, distro, parameters)
    for service, (type, text) in _SERVICES.items():
        protocol.registry.add_service(f"rosapi_msgs/{type}", text)
        handler = handlers.handler(service)
        protocol.services.serve(f"/rosapi/{service}", f"rosapi_msgs/{type}", handler)
