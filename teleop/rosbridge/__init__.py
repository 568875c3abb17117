"""A rosbridge v2 library: the protocol without sockets, its messages, a server, a client."""

from teleop.rosbridge.auth.authenticator import Gate as Gate
from teleop.rosbridge.auth.credentials import Keyring as Keyring, read_keyring as read_keyring
from teleop.rosbridge.auth.permissions import Access as Access, Role as Role, Rules as Rules
from teleop.rosbridge.auth.tls import tls_context as tls_context
from teleop.rosbridge.auth.token_file import TokenFile as TokenFile, TokenWatch as TokenWatch
from teleop.rosbridge.client.client import Client as Client
from teleop.rosbridge.client.reconnecting_connection import ConnectionState as ConnectionState
from teleop.rosbridge.compat.client_traffic import announce_traffic as announce_traffic
from teleop.rosbridge.compat.rosapi import serve_rosapi as serve_rosapi
from teleop.rosbridge.errors import (
    ClientError as ClientError,
    FrameError as FrameError,
    MessageError as MessageError,
    OperationError as OperationError,
    RosbridgeError as RosbridgeError,
    ServerError as ServerError,
    ServiceCallError as ServiceCallError,
    ServiceError as ServiceError,
    TypeNameError as TypeNameError,
)
from teleop.rosbridge.framing.outgoing_frames import (
    Close as Close,
    Kind as Kind,
    Outgoing as Outgoing,
)
from teleop.rosbridge.graph.services import Later as Later
from teleop.rosbridge.limits import Limits as Limits
from teleop.rosbridge.messages.json_cbor_codec import Codec as Codec
from teleop.rosbridge.messages.message_completion import (
    complete as complete,
    default as default,
    stamp as stamp,
)
from teleop.rosbridge.messages.message_types import Message as Message
from teleop.rosbridge.messages.type_registry import Registry as Registry
from teleop.rosbridge.protocol.protocol import Protocol as Protocol
from teleop.rosbridge.server.keepalive import Pulse as Pulse
from teleop.rosbridge.server.outbox import Bounds as Bounds
from teleop.rosbridge.server.server import Server as Server
