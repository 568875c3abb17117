from types import SimpleNamespace

import pytest
from hypothesis import given, strategies as st

from localization.logs.ros_stamps import stamp_from_message, stamp_to_dict
from localization.logs.ros_types import stamp_message

stamps = st.integers(0, 2**31 * 1_000_000_000 - 1)


@given(stamps)
def test_message_object_and_dictionary_hold_the_stamp_exactly(stamp: int) -> None:
    message = stamp_message(stamp)
    assert {"sec": message.sec, "nanosec": message.nanosec} == stamp_to_dict(stamp)
    assert (message.sec, message.nanosec) == divmod(stamp, 1_000_000_000)
    assert stamp_from_message(message) == stamp_from_message(stamp_to_dict(stamp)) == stamp


def test_ros_1_names_of_the_fields_are_read() -> None:
    assert stamp_from_message({"secs": 3, "nsecs": 7}) == 3_000_000_007


def test_stamp_without_its_fields_is_rejected() -> None:
    with pytest.raises(KeyError):
        stamp_from_message({"sec": 3})
    with pytest.raises(AttributeError):
        stamp_from_message(SimpleNamespace(sec=3))
