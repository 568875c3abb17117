"""Emulated links: the same for the same seed, in order, and bad settings are named."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from teleop.errors import SettingError
from teleop.link.emulation import SECOND, Direction, LinkConfig, LinkEmulation


def seconds(link: LinkEmulation, times: list[float], size: int = 100) -> list[float]:
    """Return when frames that a client sends at times [s] arrive [s]."""
    return [link.arrival(1, size, round(t * SECOND)) / SECOND for t in times]


def test_settings_hold_for_both_directions_or_for_one() -> None:
    config = LinkConfig.parse(("delay=0.3", "up.jitter=0.1", "down.delay=0.5", "seed=7"))
    assert config == LinkConfig(Direction(0.3, 0.1), Direction(0.5), 7)


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("delay", "no profile 'delay'; there are geo, lan, lte"),
        ("delay=", "needs a number"),
        ("delay=fast", "needs a number"),
        ("lag=1", "there are delay, jitter"),
        ("left.delay=1", "up.delay=0.3"),
        ("delay=-1", "delay must be 0 to"),
        ("delay=nan", "delay must be 0 to"),
        ("stall=1", "needs a longer period"),
    ],
)
def test_bad_setting_is_named_with_what_would_have_worked(word: str, text: str) -> None:
    with pytest.raises(SettingError, match=text):
        LinkConfig.parse((word,))


def test_delay_rate_stall_and_blackout_hold_frames_back() -> None:
    assert seconds(LinkEmulation(LinkConfig.parse(("delay=0.3",))), [0.0, 1.0]) == [0.3, 1.3]
    slow = LinkEmulation(LinkConfig.parse(("rate=1000",)))
    assert seconds(slow, [0.0, 0.0, 5.0]) == pytest.approx([0.1, 0.2, 5.1])
    stalls = LinkEmulation(LinkConfig.parse(("stall=0.4", "period=1")))
    assert seconds(stalls, [0.0, 0.5, 0.7, 1.2]) == pytest.approx([0.0, 0.5, 1.0, 1.2])
    dark = LinkEmulation(LinkConfig.parse(("up.blackout=3", "up.at=2")))
    assert seconds(dark, [0.0, 1.9, 2.5, 4.0, 5.5]) == pytest.approx([0.0, 1.9, 5.0, 5.0, 5.5])
    assert dark.departure(1, 100, 3 * SECOND) == 3 * SECOND, "the other direction is open"
    growing = LinkEmulation(LinkConfig.parse(("growth=0.5",)))
    assert seconds(growing, [0.0, 1.0, 4.0]) == pytest.approx([0.0, 1.5, 6.0])


@given(
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=50),
    st.floats(0.0, 1.0),
    st.integers(0, 1000),
)
def test_no_frame_overtakes_another_and_a_seed_gives_the_same_times(
    steps: list[float], jitter: float, seed: int
) -> None:
    config = LinkConfig(Direction(0.1, jitter, rate=1e4), Direction(), seed)
    times = [sum(steps[: n + 1]) for n in range(len(steps))]
    one, other = seconds(LinkEmulation(config), times), seconds(LinkEmulation(config), times)
    assert one == other
    assert one == sorted(one)
    assert all(arrived >= sent + 0.1 - 1e-9 for sent, arrived in zip(times, one, strict=True))
