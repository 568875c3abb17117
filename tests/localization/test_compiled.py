from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from localization import compiled
from localization.compiled import first_surfaces, plane_distances, robust_weights, share_near
from localization.maps.prepared_map import PreparedMap
from tests.support_rooms import HALL


@pytest.fixture(scope="module")
def hall() -> PreparedMap:
    return HALL.prepared()


def interpreted(loop: object) -> Any:
    return loop.py_func  # type: ignore[attr-defined]


@pytest.mark.parametrize("rough", [False, True])
def test_compiled_distances_are_those_of_the_same_lines_in_python(
    hall: PreparedMap, rough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(0)
    arms = rng.uniform([-6.0, -5.0, -0.5], [6.0, 5.0, 3.0], size=(300, 3))
    position, rotation = np.array([0.3, -0.2, 0.1]), np.eye(3)
    scanners = np.zeros_like(arms)
    given = (arms, scanners, position, rotation, hall.arrays, not rough, rough)
    found = plane_distances(*given)
    for name in ("_nearest", "_nearest_of_four", "_put_derivative"):
        monkeypatch.setattr(compiled, name, interpreted(getattr(compiled, name)))
    expected = interpreted(plane_distances)(*given)
    assert np.isfinite(found[0]).sum() > 20
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(np.asarray(one), other, atol=1e-12)


def test_places_that_are_not_finite_are_near_nothing(hall: PreparedMap) -> None:
    places = np.array([[np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0], [0.0, -np.inf, 0.0], [1e300] * 3])
    assert (hall.grid.nearest(places) == -1).all()


def test_weights_end_at_the_gate_and_where_nothing_is_near() -> None:
    distance = np.array([0.0, 0.04, -0.04, 0.13, np.nan])
    weight = robust_weights(distance, np.zeros(0), 0.3, 0.04, 0.12)
    assert weight == pytest.approx([1.0, 0.25, 0.25, 0.0, 0.0])
    along = robust_weights(distance, np.full(5, 0.04), 1.0, 0.04, 0.12)
    assert along == pytest.approx([0.25, 1.0 / 9.0, 1.0 / 9.0, 0.0, 0.0])


def test_first_surface_on_a_beam_is_the_nearest_that_it_cuts(hall: PreparedMap) -> None:
    start, line = np.array([[1.0, 1.0, 0.5]] * 2), np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    met, facing = first_surfaces(
        start, line, np.array([30.0, 0.4]), hall.arrays, 0.3, 0.1, 0.12, 0.1
    )
    near = np.abs(hall.cloud.points[:, 1:] - start[0, 1:]).max(axis=1) < 0.1
    walls = hall.cloud.points[near & (hall.cloud.normals[:, 0] < -0.9), 0]
    assert met[0] == pytest.approx(walls[walls > 1.3].min() - 1.0, abs=0.02)
    assert facing[0]
    assert np.isinf(met[1]), "the ceiling is farther than was asked for"


def test_share_near_counts_each_point_once_in_any_order() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [9.0, 0.0]])
    others = np.array([[2.1, 0.0], [0.0, 0.1], [0.9, 0.0], [0.95, 0.0]])
    assert share_near(points, others, 0.2) == 0.75
    assert share_near(points, others[::-1].copy(), 0.2) == 0.75


def test_where_nothing_can_be_kept_each_process_compiles_anew(tmp_path: Path) -> None:
    """As of an installation in a file system that is read-only, with no home."""
    package = tmp_path / "localization"
    package.mkdir()
    (package / "__init__.py").write_text("")
    source = Path(compiled.__file__).read_text(encoding="utf-8")
    (package / "compiled.py").write_text(source, encoding="utf-8")
    (package / "__pycache__").write_text("no folder")
    program = (
        "import numpy as np; from localization.compiled import share_near as near;"
        "print(near(np.zeros((2, 2)), np.zeros((1, 2)), 0.1))"
    )
    home = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null", "PATH": ""}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env=home, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == 1.0
