"""A rosbridge v2 library: message types, the protocol without sockets, a server and a client.

The parts of a ``Protocol`` are used directly: ``protocol.topics.publish``, ``protocol.services.serve``,
``protocol.connections.send_status``. A ``Server`` serves a protocol on a WebSocket.
"""

from teleop.rosbridge.auth.authenticator import Authenticator as Authenticator
from teleop.rosbridge.auth.credentials import (
    Credentials as Credentials,
    read_credentials as read_credentials,
)
from teleop.rosbridge.auth.permissions import (
    DEFAULT_RULES as DEFAULT_RULES,
    Access as Access,
    Role as Role,
    RoleRules as RoleRules,
)
from teleop.rosbridge.auth.tls import tls_context as tls_context
from teleop.rosbridge.auth.token_file import TokenFile as TokenFile, TokenWatch as TokenWatch
from teleop.rosbridge.client.client import Client as Client
from teleop.rosbridge.client.goals import GoalResult as GoalResult
from teleop.rosbridge.client.reconnecting_connection import ConnectionState as ConnectionState
from teleop.rosbridge.compat.client_traffic import publish_client_traffic as publish_client_traffic
from teleop.rosbridge.compat.rosapi import serve_rosapi as serve_rosapi
from teleop.rosbridge.compat.standard_services import serve_standard as serve_standard
from teleop.rosbridge.errors import (
    ClientError as ClientError,
    FrameError as FrameError,
    GoalError as GoalError,
    GoalLostError as GoalLostError,
    GoalRejectedError as GoalRejectedError,
    MessageError as MessageError,
    OperationError as OperationError,
    RosbridgeError as RosbridgeError,
    ServerError as ServerError,
    ServiceCallError as ServiceCallError,
    ServiceError as ServiceError,
    TypeNameError as TypeNameError,
)
from teleop.rosbridge.framing.outbox import QueueLimits as QueueLimits
from teleop.rosbridge.framing.outgoing_frames import (
    CloseFrame as CloseFrame,
    FrameKind as FrameKind,
    OutgoingFrame as OutgoingFrame,
    Output as Output,
)
from teleop.rosbridge.graph.deferred_response import DeferredResponse as DeferredResponse
from teleop.rosbridge.limits import ClientLimits as ClientLimits, TokenBucket as TokenBucket
from teleop.rosbridge.messages.json_cbor_codec import Codec as Codec
from teleop.rosbridge.messages.message_completion import complete as complete
from teleop.rosbridge.messages.message_defaults import default as default
from teleop.rosbridge.messages.message_types import Message as Message
from teleop.rosbridge.messages.type_registry import TypeRegistry as TypeRegistry
from teleop.rosbridge.protocol.connection import Connection as Connection
from teleop.rosbridge.protocol.frame_delay import FrameDelay as FrameDelay
from teleop.rosbridge.protocol.observers import Observer as Observer
from teleop.rosbridge.protocol.protocol import Protocol as Protocol
from teleop.rosbridge.protocol.refusals import Refusal as Refusal
from teleop.rosbridge.protocol.round_trips import RoundTrip as RoundTrip
from teleop.rosbridge.ros_time import nanoseconds as nanoseconds, stamp as stamp
from teleop.rosbridge.server.dated_loop import DatedEventLoop as DatedEventLoop
from teleop.rosbridge.server.keepalive import Keepalive as Keepalive
from teleop.rosbridge.server.server import Server as Server
