"""The services and topics that clients expect of every rosbridge server."""

from __future__ import annotations

from teleop.rosbridge.compat.connected_clients import publish_connected_clients
from teleop.rosbridge.compat.rosapi import serve_rosapi
from teleop.rosbridge.compat.rosout import publish_rosout
from teleop.rosbridge.compat.tf2_web_republisher import serve_republisher
from teleop.rosbridge.protocol.protocol import Protocol


def serve_standard(protocol: Protocol) -> None:
    """Provide ``/rosapi``, ``tf2_web_republisher``, ``/rosout`` and the topics of clients."""
    serve_rosapi(protocol)
    serve_republisher(protocol)
    publish_connected_clients(protocol)
    publish_rosout(protocol)
