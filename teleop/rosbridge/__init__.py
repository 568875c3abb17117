"""A rosbridge v2 library: the protocol without sockets, its messages, a server, a client."""

from teleop.rosbridge.access import Access as Access, Role as Role, Rules as Rules
from teleop.rosbridge.client import Client as Client
from teleop.rosbridge.codec import Codec as Codec
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
from teleop.rosbridge.gate import Gate as Gate
from teleop.rosbridge.keyring import Keyring as Keyring, read_keyring as read_keyring
from teleop.rosbridge.limits import Limits as Limits
from teleop.rosbridge.line import ConnectionState as ConnectionState
from teleop.rosbridge.messages import complete as complete, default as default, stamp as stamp
from teleop.rosbridge.outbox import Bounds as Bounds
from teleop.rosbridge.outgoing import Close as Close, Kind as Kind, Outgoing as Outgoing
from teleop.rosbridge.protocol import Protocol as Protocol
from teleop.rosbridge.pulse import Pulse as Pulse
from teleop.rosbridge.registry import Registry as Registry
from teleop.rosbridge.rosapi import serve_rosapi as serve_rosapi
from teleop.rosbridge.server import Server as Server
from teleop.rosbridge.services import Later as Later
from teleop.rosbridge.tls import tls_context as tls_context
from teleop.rosbridge.token_file import TokenFile as TokenFile, TokenWatch as TokenWatch
from teleop.rosbridge.traffic import announce_traffic as announce_traffic
from teleop.rosbridge.types import Message as Message
