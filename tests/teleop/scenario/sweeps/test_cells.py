from __future__ import annotations

import pytest

from teleop.errors import SettingError
from teleop.scenario.sweeps.cells import runs_of, seed_of
from tests.teleop.scenario.sweeps.support import cells


def test_cells_are_all_combinations_and_the_last_field_varies_fastest() -> None:
    made = cells("link.delay=0,1", "operator.speed=0.3,0.6,0.9")
    values = [tuple(value for _, value in cell.values) for cell in made]
    assert values == [(d, s) for d in (0.0, 1.0) for s in (0.3, 0.6, 0.9)]
    assert [cell.number for cell in made] == list(range(6))


def test_the_seed_of_a_cell_depends_on_its_values_and_number_alone() -> None:
    small = cells("link.delay=0,1", "operator.speed=0.6")
    large = cells("operator.speed=0.3,0.6", "link.delay=0,0.5,1")
    assert seed_of(small[1], 3) == seed_of(large[5], 3)
    seeds = {seed_of(cell, number) for cell in large for number in range(1, 50)}
    assert len(seeds) == 6 * 49
    assert all(0 <= seed < 2**63 for seed in seeds)


def test_the_scenarios_own_seed_and_what_it_says_else_change_the_runs() -> None:
    first = runs_of(cells("link.delay=0"), 1)[0]
    assert first.key != runs_of(cells("link.delay=0", seed=1), 1)[0].key
    assert first.scenario.seed != runs_of(cells("link.delay=0", seed=1), 1)[0].scenario.seed
    deaf = runs_of(cells("link.delay=0", world={"scene": "corridor", "stale_limits": False}), 1)[0]
    assert deaf.key != first.key
    assert deaf.scenario.seed == first.scenario.seed  # so that both are compared by the same noise


def test_each_cell_is_run_once_before_any_is_run_twice() -> None:
    runs = runs_of(cells("link.delay=0,1"), 2)
    assert [(run.cell.number, run.number) for run in runs] == [(0, 1), (1, 1), (0, 2), (1, 2)]


@pytest.mark.parametrize(
    ("over", "says"),
    [
        (("link.delay=0,0.0",), "same value twice"),
        (("link.delay=0", "link.delay=1"), "given twice"),
        (("link.delay=0:999:1", "link.jitter=0:999:1"), "too many"),
    ],
)
def test_a_sweep_that_says_things_twice_or_never_ends_is_refused(
    over: tuple[str, ...], says: str
) -> None:
    with pytest.raises(SettingError, match=says):
        cells(*over)


def test_fewer_than_one_seed_and_too_many_runs_are_refused() -> None:
    with pytest.raises(SettingError, match="--seeds must be >= 1"):
        runs_of(cells("link.delay=0"), 0)
    with pytest.raises(SettingError, match="too many"):
        runs_of(cells("link.delay=0,1"), 60_000)
