"""The gateway to a robot's clients: its server and all that it offers, wherever the robot is driven."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Protocol as Interfaces

from teleop import clock
from teleop.console.page_files import offer_page
from teleop.link.emulation import EmulatedLinks
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.clients.rosbridge_adapter import RosbridgeAdapter
from teleop.robot.playground.playground_services import PlaygroundServices
from teleop.robot.runs.run_book import RunBook
from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.serving.server_setup import (
    address_of,
    audit_log,
    build_server,
    offer_map,
    offer_surfaces,
    round_trips_of,
    token_file,
    watch_tokens,
)
from teleop.robot.serving.share_services import offer_sharing
from teleop.robot.tick_record import DriveRecord, EstimateRecord
from teleop.robot.topics.message_parts import Message
from teleop.robot.topics.topic_table import Interface
from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.token_file import TokenWatch
from teleop.rosbridge.server.server import Server

if TYPE_CHECKING:  # imported only where there is a camera
    from robot_sim.cameras import CameraModel
    from teleop.pictures.picture_hub import PictureHub
    from teleop.robot.video.robot_video import RobotVideo


class Camera(Interfaces):
    """A camera whose pictures a server offers, drawn here or in another process."""

    hub: PictureHub
    """Where viewers get pictures."""
    model: CameraModel
    """The camera's numbers."""

    def ticked(self, stamp: int) -> None:
        """Follow what is subscribed to; ``stamp`` is the robot's time after a tick [ns]."""

    def close(self) -> None:
        """Free what it needs."""


class Gateway:
    """The server of a robot whose records are handed to ``driven`` and ``estimated``, with topics, files and video."""

    def __init__(
        self,
        config: ServeConfig,
        latched: Callable[[CameraModel | None], Mapping[Interface, Message]],
        now: Callable[[], int],
        *,
        undo_memory: int,
        scene: str = "",
        camera: Callable[[Server], Camera | None] = lambda server: None,
        video: bool = True,
        authenticator: Authenticator | None = None,
        link: EmulatedLinks | None = None,
        hidden: Collection[str] = (),
        arm: ArmFit | None = None,
    ) -> None:
        """Build a server that does not listen yet.

        Args:
            config: Settings.
            latched: Returns the messages that are published once; its argument is the robot's camera, if it has one.
            now: Returns the time of the server's clock [ns].
            undo_memory: Time for which a placement can be undone [ns].
            scene: Name of the scene, for the audit log.
            camera: Returns the robot's camera; None for none.
            video: Whether streams and photographs of the camera are offered, beside its topics.
            authenticator: Verifies tokens in the place of the file that the settings name.
            link: Emulates the links of clients in the place of that of the settings.
            hidden: Names of topics that are not published.
            arm: The arm that the robot carries, if any.

        Raises:
            ServerError: If tokens, certificate or origins are invalid.
            AuditError: If the audit log cannot be written.
            CameraError: If there is no camera of that name.
        """
        self._tokens = token_file(config)
        self.server = build_server(
            config, self._tokens, now, authenticator=authenticator, link=link
        )
        self._stamp, self._closed = 0, False
        self.page = False
        """Whether the console page is offered."""
        self._watch: TokenWatch | None = None
        with ExitStack() as cleanup:
            self._audit = cleanup.enter_context(
                audit_log(config, self.server, scene, lambda: self._stamp)
            )
            self.camera = camera(self.server)
            """The robot's camera, if it has one."""
            if self.camera is not None:
                cleanup.enter_context(closing(self.camera))
            once = latched(None if self.camera is None else self.camera.model)
            self._video: RobotVideo | None = None
            if video and self.camera is not None:
                self._video = _video(self.server, self.camera, config, once, self._audit)
            self.adapter = RosbridgeAdapter(
                self.server,
                once,
                undo_memory=undo_memory,
                round_trips=round_trips_of(self.server),
                audit=self._audit,
                hidden=hidden,
                arm=arm,
            )
            """The robot's topics and services."""
            self._runs = cleanup.enter_context(
                closing(
                    RunBook(
                        self.server,
                        config.runs,
                        space=round(config.runs_space * 1e9),
                        stamp=lambda: self._stamp,
                        date=clock.utc_text,
                        audit=self._audit,
                    )
                )
            )
            self._cleanup = cleanup.pop_all()

        if config.lan and config.tokens is not None:
            offer_sharing(self.server, config.tokens, self._audit)
        self._playground: PlaygroundServices | None = None
        if config.playground:
            protocol, wishes = self.server.protocol, self.adapter.wishes
            self._playground = PlaygroundServices(protocol, wishes, self._audit)

    def offer_files(self, map_file: Path | None, surfaces: bytes | None = None) -> None:
        """Offer the console page, the map if there is a file of it, and its surfaces if given, over HTTP on the same port."""
        offer_map(self.server, map_file)
        self._runs.surfaces = surfaces
        if surfaces is not None:
            offer_surfaces(self.server, surfaces)
        self.page = offer_page(self.server.pages, encrypted=self.server.encrypted)

    def driven(self, tick: DriveRecord) -> None:
        """Publish what control did in a tick."""
        self._stamp = tick.stamp
        self.adapter.driven(tick)
        if self._playground is not None:
            self._playground.driven(tick)
        if tick.paused:
            return
        if self._video is not None:
            self._video.driven(tick)
        if self.camera is not None:
            self.camera.ticked(tick.stamp)

    def estimated(self, tick: EstimateRecord) -> None:
        """Publish what the localiser made of a tick."""
        self.adapter.estimated(tick)
        if self._video is not None:
            self._video.estimated(tick)

    def read_tokens(self) -> None:
        """Read the file of tokens again, if there is one."""
        if self._watch is not None:
            self._watch.check_now()

    async def start(self) -> Address:
        """Listen from now on; return where.

        Raises:
            ServerError: If a port is not available.
        """
        if self._tokens is not None:
            watch = watch_tokens(self._tokens, self.server, self._audit)
            self._watch = self._cleanup.enter_context(closing(watch))
        await self.server.start()
        streams = "" if self._video is None else await self._video.start()
        return address_of(self.server, page=self.page, streams=streams)

    async def close(self) -> None:
        """Stop listening, and end the audit log and the camera, if that has not been done."""
        if self._closed:
            return
        self._closed = True
        try:
            if self._video is not None:
                await self._video.close()
            await self.server.close()
        finally:
            self._cleanup.close()


def _video(
    server: Server,
    camera: Camera,
    config: ServeConfig,
    latched: Mapping[Interface, Message],
    audit: AuditLog | None,
) -> RobotVideo:
    """Offer the camera's streams and photographs; imported here, since most robots have none."""
    from teleop.robot.video.robot_video import RobotVideo

    size = camera.model.width, camera.model.height
    return RobotVideo(server, camera.hub, size, config, latched, audit)
