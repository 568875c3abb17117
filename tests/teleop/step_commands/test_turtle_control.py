"""Commands of the topic turtle_control, as the glasses send them."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given, strategies as st

from teleop.step_commands.commands import Photo, Step, StepCommand, StepCommandError
from teleop.step_commands.turtle_control import MAX_LENGTH, StepSizes, read_turtle_control

SET = StepSizes(distance=0.5, angle=15)
QUARTER = math.radians(15)


@pytest.mark.parametrize(
    ("text", "command"),
    [
        ('{"movement": "up"}', Step(distance=0.5)),
        ('{"movement": "down"}', Step(distance=-0.5)),
        ('{"movement": "left"}', Step(angle=QUARTER)),
        ('{"movement": "right"}', Step(angle=-QUARTER)),
        ('{"action": "photo"}', Photo()),
    ],
)
def test_each_movement_is_one_step_of_the_size_that_was_set(
    text: str, command: StepCommand
) -> None:
    assert read_turtle_control(text, SET) == (SET, (command,))
    assert read_turtle_control(text.encode(), SET) == (SET, (command,))


@pytest.mark.parametrize("value", ['"0.25"', "0.25", '" .25"', '"2.5e-1"'])
def test_distance_is_a_number_or_its_text_and_persists(value: str) -> None:
    sizes, commands = read_turtle_control(f'{{"distance": {value}}}', StepSizes())
    assert (sizes, commands) == (StepSizes(distance=0.25), ())
    assert read_turtle_control('{"movement": "up"}', sizes)[1] == (Step(distance=0.25),)


@pytest.mark.parametrize("value", ['"30"', "30", "30.0"])
def test_angle_is_whole_degrees_or_their_text_and_persists(value: str) -> None:
    sizes, _ = read_turtle_control(f'{{"angle": {value}}}', StepSizes())
    assert read_turtle_control('{"movement": "left"}', sizes)[1] == (Step(angle=math.radians(30)),)


def test_keys_of_one_command_take_effect_in_their_order() -> None:
    before = read_turtle_control('{"movement": "up", "distance": 2, "action": "photo"}', SET)
    assert before == (StepSizes(2.0, 15), (Step(distance=0.5), Photo()))
    after = read_turtle_control('{"action": "photo", "distance": 2, "movement": "up"}', SET)
    assert after == (StepSizes(2.0, 15), (Photo(), Step(distance=2.0)))


def test_right_turns_left_only_for_a_sender_that_wants_it() -> None:
    inverted = StepSizes(0.5, 15, right_turns_left=True)
    assert read_turtle_control('{"movement": "right"}', inverted)[1] == (Step(angle=QUARTER),)
    assert read_turtle_control('{"movement": "left"}', inverted)[1] == (Step(angle=-QUARTER),)
    assert read_turtle_control('{"movement": "up"}', inverted)[1] == (Step(distance=0.5),)


def test_a_sender_may_invert_its_turns_itself() -> None:
    sizes, commands = read_turtle_control('{"invert_turns": true, "movement": "right"}', SET)
    assert commands == (Step(angle=QUARTER),)
    assert read_turtle_control('{"invert_turns": false}', sizes) == (SET, ())


def test_speeds_of_the_sender_are_those_of_its_steps() -> None:
    fast = StepSizes(0.5, 15, speed=0.3, turn_speed=0.8)
    assert read_turtle_control('{"movement": "down"}', fast)[1] == (Step(-0.5, 0.0, 0.3),)
    assert read_turtle_control('{"movement": "left"}', fast)[1] == (Step(0.0, QUARTER, 0.8),)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"distance": "far"}', "distance must be a number of metres .* got 'far'"),
        ('{"distance": -1}', "distance must be .* got -1"),
        ('{"distance": 0}', "distance must be"),
        ('{"distance": true}', "distance must be"),
        ('{"distance": NaN}', "distance must be"),
        ('{"distance": "1_0"}', "distance must be"),
        ('{"distance": "0,5"}', 'such as 0.5 or "0.5"'),
        ('{"distance": 101}', "up to 100"),
        ('{"distance": {"a": 1}}', "got an object"),
        ('{"distance": ' + "9" * 400 + "}", "distance must be"),
        ('{"angle": 15.5}', "angle must be whole degrees from 1 to 360"),
        ('{"angle": 361}', "angle must be whole degrees"),
        ('{"angle": null}', "angle must be whole degrees"),
        ('{"movement": "forward"}', "movement must be one of up, down, left, right"),
        ('{"movement": ["up"]}', "movement must be one of"),
        ('{"action": "dance"}', "action must be photo"),
        ('{"invert_turns": 1}', "invert_turns must be true or false"),
        ('{"speed": 1}', "unknown key 'speed'; known are distance, angle, movement, action"),
        ('{"movement": "up", "movement": "up"}', "movement is given twice"),
        ("{}", "JSON object such as"),
        ("[1]", "JSON object such as"),
        ("up", "JSON object such as"),
        (b"\xff", "JSON object such as"),
        ("[" * 4000, "JSON object such as"),
        ('{"a": "' + "x" * MAX_LENGTH + '"}', "at most 4096 characters"),
    ],
)
def test_invalid_commands_name_the_field_and_what_works(text: str | bytes, words: str) -> None:
    with pytest.raises(StepCommandError, match=words) as error:
        read_turtle_control(text, SET)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(("movement", "key"), [("up", "distance"), ("right", "angle")])
def test_a_movement_before_its_size_is_refused_with_what_to_send(movement: str, key: str) -> None:
    with pytest.raises(StepCommandError, match=f'send {{"{key}"'):
        read_turtle_control(json.dumps({"movement": movement}), StepSizes())


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ((0.0, 0.0, 0.0), "needs a distance"),
        ((math.nan, 0.0, 0.0), "distance must be a finite number"),
        ((0.0, math.inf, 0.0), "angle must be a finite number"),
        ((1.0, 0.0, -1.0), "speed must be > 0"),
        ((100.1, 0.0, 0.0), "distance must be -100 to 100 m"),
        ((0.0, 6.3, 0.0), "angle must be -2 pi to 2 pi"),
    ],
)
def test_a_step_that_is_no_motion_cannot_be_made(
    values: tuple[float, float, float], words: str
) -> None:
    with pytest.raises(StepCommandError, match=words):
        Step(*values)


@given(
    st.one_of(
        st.text(),
        st.binary(),
        st.recursive(
            st.none() | st.booleans() | st.floats() | st.integers() | st.text(),
            lambda inner: (
                st.lists(inner)
                | st.dictionaries(
                    st.sampled_from(["distance", "angle", "movement", "action", "other"]), inner
                )
            ),
        ).map(json.dumps),
    )
)
def test_any_text_is_read_or_refused_in_one_line(text: str | bytes) -> None:
    commands: tuple[StepCommand, ...] = ()
    problem = "one line"
    try:
        commands = read_turtle_control(text, SET)[1]
    except StepCommandError as error:
        problem = str(error)
    assert len(problem.splitlines()) == 1
    assert all(isinstance(command, Step | Photo) for command in commands)
