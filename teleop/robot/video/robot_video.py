"""Video and photographs of a robot with a camera, on the ports that its settings name."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from teleop import clock
from teleop.console.lan.own_addresses import own_addresses
from teleop.pictures.picture import PictureFormat
from teleop.pictures.picture_hub import PictureHub
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.clients.whoami_service import may_drive
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.tick_record import DriveRecord, EstimateRecord
from teleop.robot.topics.message_parts import Message
from teleop.robot.topics.topic_table import MAP_INFO, Interface
from teleop.robot.video.pose_memory import PoseMemory
from teleop.rosbridge.server.http_handlers import HttpHandlers, HttpRequest
from teleop.rosbridge.server.http_server import HttpServer
from teleop.rosbridge.server.server import Server
from teleop.video.cam_sources import announce, base_address, cam_sources
from teleop.video.photographs.photo_folder import PhotoFolder
from teleop.video.photographs.photo_pages import PhotoPages
from teleop.video.photographs.photographer import QUALITY, PhotoContext, Photographer
from teleop.video.tickets import Tickets
from teleop.video.video_pages import VideoPages
from teleop.video.video_topics import video_topics
from teleop.video.viewer_access import ViewerAccess

if TYPE_CHECKING:
    from teleop.video.webrtc.webrtc_pages import WebrtcPages

_EVERYWHERE: Final = ("0.0.0.0", "::", "")


class RobotVideo:
    """Offers what a hub's pictures show, from the start of the server until ``close``."""

    def __init__(
        self,
        server: Server,
        hub: PictureHub,
        size: tuple[int, int],
        config: ServeConfig,
        latched: Mapping[Interface, Message],
        audit: AuditLog | None = None,
    ) -> None:
        """Offer pages and services.

        Args:
            server: The robot's server, not yet started.
            hub: Where pictures come from.
            size: Width and height of the camera's pictures [pixels].
            config: Settings of the robot.
            latched: Messages that are published once; the map's is needed here.
            audit: Log of what clients do to the robot.
        """
        self._server, self._name, self._stamp = server, config.name, 0
        self._audit = audit
        topics = video_topics(*size)
        access = ViewerAccess(server.protocol, Tickets(clock.wall_seconds), self._refused)
        pages = VideoPages(hub, topics, access, lambda: self._stamp)
        pages.add_to(server.handlers)
        access.add_page(server.handlers)
        self._webrtc: WebrtcPages | None = None
        if config.webrtc:
            # Imported here, since it loads FFmpeg's libraries.
            from teleop.video.webrtc.webrtc_pages import WebrtcPages

            self._webrtc = WebrtcPages(hub, topics, access, lambda: server.addresses)
            self._webrtc.add_to(server.handlers)
        self._poses, info = PoseMemory(), latched.get(MAP_INFO, {})
        around = PhotoContext(
            self._poses.at, clock.utc_text, str(info.get("name", "")), str(info.get("sha256", ""))
        )
        whole = PictureFormat(topics[0].source, "jpeg", *size, QUALITY)
        folder = PhotoFolder(config.photos)
        self._photographer = Photographer(folder, whole, pages.next_picture, around)
        note = None if audit is None else audit.photo
        photos = PhotoPages(self._photographer, access, whole.topic, may_drive, note)
        photos.add_to(server)
        self._further: HttpServer | None = None
        if config.video_port is not None:
            handlers = HttpHandlers()
            pages.add_to(handlers)
            pages.add_to(handlers, index="/")
            access.add_page(handlers)
            self._further = HttpServer(server, config.video_port, handlers)

    def _refused(self, request: HttpRequest, why: str) -> None:
        if self._audit is not None:
            self._audit.viewer_refused(request.address, request.access, request.path, why)

    def driven(self, tick: DriveRecord) -> None:
        """Note the robot's time."""
        self._stamp = tick.stamp

    def estimated(self, tick: EstimateRecord) -> None:
        """Note where the robot is."""
        self._poses.estimated(tick)

    async def start(self) -> str:
        """Listen on the further port, and announce the streams; the robot's server has started.

        Returns:
            The address of the list of streams.

        Raises:
            ServerError: If the port is not available.
        """
        port = self._server.port
        if self._further is not None:
            await self._further.start()
            port = self._further.port
        host = self._server.host
        if host in _EVERYWHERE:
            addresses = await asyncio.to_thread(own_addresses)
            host = (addresses or ["127.0.0.1"])[0]
        base = base_address(host, port, encrypted=self._server.encrypted)
        announce(self._server.protocol, cam_sources(self._name, base), self._server.now)
        return f"{base}/streams"

    async def close(self) -> None:
        """Stop listening on the further port and end WebRTC; photographs that were taken are stored."""
        if self._webrtc is not None:
            await self._webrtc.close()
        if self._further is not None:
            await self._further.close()
        self._photographer.close()
