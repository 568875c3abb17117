"""The banner of the display as a picture: a viewer's text has neither colour nor size."""

from __future__ import annotations

import io
from functools import cache
from typing import Final

from PIL import Image, ImageDraw, ImageFont

from localization.display.colours import GREEN, ORANGE, RED, SKY, STALE, Colour
from teleop.operator.robot_state.alarm_rules import Severity
from teleop.operator.robot_state.banner import Banner

WIDTH: Final = 2200
"""Width of the picture [pixels]."""
HEIGHT: Final = 88
"""Height of the picture [pixels]."""

_COLOURS: Final[dict[Severity, Colour]] = {
    Severity.CALM: GREEN,
    Severity.INFO: SKY,
    Severity.STALE: STALE,
    Severity.WARNING: ORANGE,
    Severity.ALARM: RED,
}
_DARK: Final[Colour] = (16, 17, 20)
_PALE: Final[Colour] = (205, 205, 205)
_LINK_WIDTH: Final = 640
_FIGURES_WIDTH: Final = 380
_MARGIN: Final = 16


def draw_banner(banner: Banner) -> bytes:
    """Return the banner as PNG, ``WIDTH`` by ``HEIGHT`` pixels."""
    image = Image.new("RGB", (WIDTH, HEIGHT), _DARK)
    draw = ImageDraw.Draw(image)
    _block(draw, (0, _LINK_WIDTH), banner.link.severity, (banner.link.text,))
    worst = max((notice.severity for notice in banner.notices), default=Severity.CALM)
    texts = tuple(notice.text for notice in banner.notices)
    _block(draw, (_LINK_WIDTH + 4, WIDTH - _FIGURES_WIDTH - 4), worst, texts)
    for i, line in enumerate(banner.figures[:3]):
        place = (WIDTH - _FIGURES_WIDTH + _MARGIN, 1 + 29 * i)
        draw.text(place, line, font=_font(24), fill=_PALE)
    data = io.BytesIO()
    image.save(data, "PNG", compress_level=1)
    return data.getvalue()


def _block(
    draw: ImageDraw.ImageDraw, span: tuple[int, int], severity: Severity, texts: tuple[str, ...]
) -> None:
    """Draw a coloured block with texts, as large as they fit."""
    left, right = span
    colour = _COLOURS[severity]
    draw.rectangle((left, 0, right - 1, HEIGHT), fill=colour)
    if not texts:
        return
    # Black on light colours and white on dark ones, by luminance (ITU-R BT.601).
    bright = 0.299 * colour[0] + 0.587 * colour[1] + 0.114 * colour[2] > 110.0
    ink = (0, 0, 0) if bright else (255, 255, 255)
    width = right - left - 2 * _MARGIN
    lines, size = _fitted(draw, texts, width)
    top = 0.5 * (HEIGHT - len(lines) * 1.2 * size)
    for i, line in enumerate(lines):
        draw.text((left + _MARGIN, top + 1.2 * size * i), line, font=_font(size), fill=ink)


def _fitted(draw: ImageDraw.ImageDraw, texts: tuple[str, ...], width: int) -> tuple[list[str], int]:
    """Return the lines and the font size at which they fill the block."""
    lines: list[str] = []
    for size in (42, 36, 32, 27, 23, 19):
        lines = [line for text in texts for line in _wrapped(draw, text, size, width)]
        if len(lines) * 1.2 * size <= HEIGHT:
            return lines, size
    return lines[:4], 19


def _wrapped(draw: ImageDraw.ImageDraw, text: str, size: int, width: int) -> list[str]:
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if draw.textlength(longer, font=_font(size)) <= width or not lines[-1]:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


@cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)
