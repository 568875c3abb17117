from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from teleop.errors import SettingError
from teleop.scenario.sweeps.axes import axis_of


def test_a_range_holds_both_ends_in_exact_decimals() -> None:
    assert axis_of("link.delay=0:2:0.25").values == tuple(i / 4 for i in range(9))
    assert axis_of("a=0:0.3:0.1").values == (0.0, 0.1, 0.2, 0.3)
    assert axis_of("a=1:4:2").values == (1, 3)
    assert axis_of("a=2:0:-1").values == (2, 1, 0)
    assert axis_of("a=-1:1:0.5").values == (-1.0, -0.5, 0.0, 0.5, 1.0)


@given(low=st.integers(-1000, 1000), step=st.integers(1, 300), count=st.integers(0, 50))
def test_a_range_in_hundredths_ends_at_its_end(low: int, step: int, count: int) -> None:
    end = low + step * count
    values = axis_of(f"a={low / 100}:{end / 100}:{step / 100}").values
    assert values == tuple((low + i * step) / 100 for i in range(count + 1))


def test_lists_hold_numbers_words_truths_and_places() -> None:
    assert axis_of("a=1,2,5").values == (1, 2, 5)
    assert axis_of("a = 0.5, 1e3").values == (0.5, 1000.0)
    assert axis_of("a=true,false").values == (True, False)
    assert axis_of("a=corridor,meeting_room").values == ("corridor", "meeting_room")
    assert axis_of("a=corridor").values == ("corridor",)
    assert axis_of("a=[1,2],[3,4,90]").values == ([1, 2], [3, 4, 90])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("link.delay", "FIELD=VALUES"),
        ("=1", "FIELD=VALUES"),
        ("a=", "FIELD=VALUES"),
        ("a=0:1:0", "step of 0"),
        ("a=0:1:-1", "does not lead"),
        ("a=0:1:0.000001", "too many"),
        ("a=0:1", "no range"),
        ("a=x:y:z", "no range"),
        ("a=;rm", "no words"),
        ("a={b=1}", "values are"),
        ("a=1979-05-27", "values are"),
    ],
)
def test_what_is_no_axis_is_refused_with_what_would_work(text: str, says: str) -> None:
    with pytest.raises(SettingError, match=says):
        axis_of(text)
