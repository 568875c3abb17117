"""What clients expect of any rosbridge server, besides the protocol itself."""

from __future__ import annotations

from teleop.rosbridge.presence import announce_clients
from teleop.rosbridge.protocol import Protocol
from teleop.rosbridge.republisher import serve_republisher
from teleop.rosbridge.rosapi import serve_rosapi
from teleop.rosbridge.rosout import announce_log


def serve_standard(protocol: Protocol) -> None:
    """Offer ``/rosapi``, ``tf2_web_republisher``, ``/rosout``, and topics that tell who is there."""
    serve_rosapi(protocol)
    serve_republisher(protocol)
    announce_clients(protocol)
    announce_log(protocol)
