"""A rosbridge v2 library: the protocol without sockets, its messages, a server, a client."""

from teleop.rosbridge.auth.authenticator import Authenticator as Authenticator
from teleop.rosbridge.auth.credentials import (
    Credentials as Credentials,
    read_credentials as read_credentials,
)
from teleop.rosbridge.auth.permissions import Access as Access, Role as Role, RoleRules as RoleRules
from teleop.rosbridge.auth.tls import tls_context as tls_context
from teleop.rosbridge.auth.token_file import TokenFile as TokenFile, TokenWatch as TokenWatch
from teleop.rosbridge.client.client import Client as Client
from teleop.rosbridge.client.reconnecting_connection import ConnectionState as ConnectionState
from teleop.rosbridge.compat.client_traffic import publish_client_traffic as publish_client_traffic
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
    CloseFrame as CloseFrame,
    FrameKind as FrameKind,
    OutgoingFrame as OutgoingFrame,
)
from teleop.rosbridge.graph.services import DeferredResponse as DeferredResponse
from teleop.rosbridge.limits import ClientLimits as ClientLimits
from teleop.rosbridge.messages.json_cbor_codec import Codec as Codec
from teleop.rosbridge.messages.message_completion import (
    complete as complete,
    default as default,
    stamp as stamp,
)
from teleop.rosbridge.messages.message_types import Message as Message
from teleop.rosbridge.messages.type_registry import TypeRegistry as TypeRegistry
from teleop.rosbridge.protocol.protocol import Protocol as Protocol
from teleop.rosbridge.server.keepalive import Keepalive as Keepalive
from teleop.rosbridge.server.outbox import QueueLimits as QueueLimits
from teleop.rosbridge.server.server import Server as Server
