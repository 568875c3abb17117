"""Gamepads by pygame-ce, which knows the standard layout of some hundred pads (SDL's game controller database)."""

from __future__ import annotations

import os
from typing import Any, Final

from teleop.operator.controls.gamepad import ButtonChanged, PadChanged, PadEvent, StickMoved

_AXES: Final = (0, 1)
"""The left stick, which SDL and browsers number alike."""
_BUTTONS: Final = {0: 0, 1: 1, 2: 2, 3: 3, 4: 8, 6: 9, 9: 4, 10: 5}
"""Indices of a standard gamepad (W3C) by SDL_GameControllerButton."""
_FULL: Final = 32768.0
"""Full deflection of an axis."""


class PygamePads:
    """The pads that SDL sees, without a window."""

    def __init__(self) -> None:
        """Open the devices.

        Raises:
            ImportError: If pygame-ce is not installed.
        """
        # SDL must neither open a window nor take Ctrl-C, and listen although none of its windows has the focus.
        os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
        os.environ.setdefault("SDL_NO_SIGNAL_HANDLERS", "1")
        os.environ.setdefault("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        import pygame
        from pygame._sdl2 import controller

        self._pygame: Any = pygame
        self._controller: Any = controller
        self._open: dict[int, Any] = {}
        pygame.display.init()
        controller.init()

    def poll(self) -> list[PadEvent]:
        """Return the events since the last call."""
        found: list[PadEvent] = []
        for event in self._pygame.event.get():
            found += self._read(event)
        return found

    def close(self) -> None:
        """Let the devices go."""
        self._open.clear()
        self._controller.quit()
        self._pygame.display.quit()

    def _read(self, event: Any) -> list[PadEvent]:
        pg = self._pygame
        if event.type == pg.CONTROLLERDEVICEADDED:
            pad = self._controller.Controller(event.device_index)
            identity = int(pad.id)
            self._open[identity] = pad
            return [PadChanged(identity, str(pad.name), present=True)]
        if event.type == pg.CONTROLLERDEVICEREMOVED:
            self._open.pop(event.instance_id, None)
            return [PadChanged(int(event.instance_id), "", present=False)]
        if event.type == pg.CONTROLLERAXISMOTION and event.axis in _AXES:
            return [StickMoved(int(event.instance_id), event.axis, event.value / _FULL)]
        if (
            event.type in (pg.CONTROLLERBUTTONDOWN, pg.CONTROLLERBUTTONUP)
            and event.button in _BUTTONS
        ):
            pressed = event.type == pg.CONTROLLERBUTTONDOWN
            return [ButtonChanged(int(event.instance_id), _BUTTONS[event.button], pressed)]
        return []


def open_pads() -> PygamePads | None:
    """Return the pads, or None without pygame-ce or where SDL cannot start."""
    try:
        return PygamePads()
    except ImportError:
        return None
    except Exception as error:
        if type(error).__module__.startswith("pygame"):
            return None
        raise
