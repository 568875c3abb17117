from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization import compiled
from localization.compiled import surfaces
from localization.compiled.surfaces import (
    Scales,
    aligned,
    first_surfaces,
    normal_equations,
    plane_distances,
    point_weights,
)
from localization.geometry import FloatArray, so3_exp
from localization.maps.prepared_map import PreparedMap
from localization.types import Pose
from tests.support import rotation_vectors


def interpreted(loop: object) -> Any:
    return loop.py_func  # type: ignore[attr-defined]


@pytest.mark.parametrize("rough", [False, True])
def test_compiled_distances_are_those_of_the_same_lines_in_python(
    hall: PreparedMap, rough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform([-6.0, -5.0, -0.5], [6.0, 5.0, 3.0], size=(300, 3))
    pose = Pose.from_euler([0.3, -0.2, 0.1], roll=0.1, pitch=-0.2, yaw=2.0)
    origins = np.full_like(points, 0.2)
    given = (points, origins, pose.position, pose.rotation, hall.arrays, not rough, rough)
    found = plane_distances(*given)
    for name in ("_nearest", "_nearest_of_four", "_put_derivative"):
        monkeypatch.setattr(surfaces, name, interpreted(getattr(surfaces, name)))
    expected = interpreted(plane_distances)(*given)
    assert np.isfinite(found[0]).sum() > 20
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(np.asarray(one), other, atol=1e-12)


def test_places_that_are_not_finite_are_near_nothing(hall: PreparedMap) -> None:
    places = np.array([[np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0], [0.0, -np.inf, 0.0], [1e300] * 3])
    assert (hall.grid.nearest(places) == -1).all()


SCALES = Scales(
    sigma=1.0, kernel=0.04, gate=3.0, tangential=0.3, effective_points=2.0,
    normal_noise=0.04, grazing=0.1, lever=5.0,
)  # fmt: skip


def weights_of(
    distance: FloatArray, along: FloatArray, *, kernel: float = 0.04, level_kernel: float = 0.04,
    upright: bool = True, limited: bool = False,
    across: float = 1.0, spread: tuple[float, ...] = (), tangential: float = 0.3,
) -> FloatArray:  # fmt: skip
    n, noise = len(distance), np.array(spread, dtype=np.float32)
    nearest = np.zeros(n, dtype=np.int32)
    scales = SCALES._replace(tangential=tangential)
    jacobian = np.zeros((n, 6))
    jacobian[:, 0 if upright else 2] = 1.0
    return point_weights(
        distance, jacobian, along, np.full(n, across), nearest, np.ones(n), noise, kernel, level_kernel,
        limited, scales,
    )  # fmt: skip


def test_weights_end_at_the_gate_and_where_nothing_is_near() -> None:
    distance = np.array([0.0, 0.04, -0.04, 0.13, np.nan])
    assert weights_of(distance, np.zeros(0)) == pytest.approx([1.0, 0.25, 0.25, 0.0, 0.0])
    along = weights_of(distance, np.full(5, 0.04), tangential=1.0)
    assert along == pytest.approx([0.25, 1.0 / 9.0, 1.0 / 9.0, 0.0, 0.0])
    limited = weights_of(np.zeros(4), np.zeros(0), limited=True)
    assert limited == pytest.approx(0.5), "four points count as two"


def test_smooth_maps_weigh_grazing_beams_and_scattered_normals_less() -> None:
    here, smooth, rough = np.zeros(1), np.zeros(0), np.zeros(1)
    assert weights_of(here, smooth, across=0.05) == pytest.approx(0.25)
    assert weights_of(here, smooth, across=0.05, kernel=0.15) == pytest.approx(1.0)
    assert weights_of(here, smooth, spread=(0.08,)) == pytest.approx(0.25)
    assert weights_of(here, rough, across=0.05, spread=(0.08,)) == pytest.approx(1.0)


def test_floors_have_a_scale_of_their_own() -> None:
    off = np.array([0.3])
    assert weights_of(off, np.zeros(0), kernel=0.15) > 0.0
    assert weights_of(off, np.zeros(0), kernel=0.15, upright=False) == 0.0
    assert weights_of(off, np.zeros(0), level_kernel=0.15, upright=False) > 0.0


def test_normal_equations_are_those_of_dense_matrices_and_leave_out_what_has_no_weight() -> None:
    rng = np.random.default_rng(3)
    jacobian, distance, weight = rng.normal(size=(50, 6)), rng.normal(size=50), rng.random(50)
    distance[:5], weight[:5] = np.nan, 0.0
    hessian, gradient = normal_equations(jacobian, distance, weight)
    seen = slice(5, None)
    weighted = jacobian[seen] * weight[seen, None]
    assert hessian == pytest.approx(weighted.T @ jacobian[seen])
    assert gradient == pytest.approx(weighted.T @ distance[seen])


@given(turn=rotation_vectors(3.0), seed=st.integers(0, 100))
def test_turns_departures_and_solutions_are_those_of_geometry_and_numpy(
    turn: FloatArray, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    before, position = so3_exp(rng.normal(size=3)), rng.normal(size=3)
    after = before.copy()
    surfaces._turn(after, *turn.tolist())
    np.testing.assert_allclose(after, before @ so3_exp(turn), atol=1e-13)
    departure = np.zeros(6)
    surfaces._put_departure(departure, position, before, position + 0.1, after)
    np.testing.assert_allclose(departure, [0.1, 0.1, 0.1, *turn], atol=1e-11)
    rows, right = rng.normal(size=(9, 6)), rng.normal(size=6)
    matrix, solution = rows.T @ rows, right.copy()
    surfaces._solve(matrix.copy(), solution)
    np.testing.assert_allclose(matrix @ solution, right, atol=1e-8)


def test_alignment_that_is_held_firmly_stays_at_its_prior(hall: PreparedMap) -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform([-6.0, -5.0, -0.5], [6.0, 5.0, 3.0], size=(300, 3))
    prior = Pose.from_euler([0.3, -0.2, 0.1], roll=0.02, pitch=-0.03, yaw=2.9)
    given = points, np.zeros_like(points), np.linalg.norm(points, axis=1)
    position, rotation, *_ = aligned(
        *given, prior.position, prior.rotation, 1e14 * np.eye(6), hall.arrays,
        np.zeros(0, dtype=np.float32), False, 0.15, 0.15, 8, 5e-4, SCALES,
    )  # fmt: skip
    np.testing.assert_allclose(position, prior.position, atol=1e-9)
    np.testing.assert_allclose(rotation, prior.rotation, atol=1e-9)


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


@pytest.mark.slow
def test_where_nothing_can_be_kept_each_process_compiles_anew(tmp_path: Path) -> None:
    """As of an installation in a file system that is read-only, with no home."""
    package = tmp_path / "localization" / "compiled"
    package.mkdir(parents=True)
    (package.parent / "__init__.py").write_text("")
    for name in ("__init__.py", "scans.py"):
        source = Path(compiled.__file__).with_name(name).read_text(encoding="utf-8")
        (package / name).write_text(source, encoding="utf-8")
    (package / "__pycache__").write_text("no folder")
    program = (
        "import numpy as np; from localization.compiled.scans import are_near as near;"
        "print(near(np.zeros((2, 2)), np.zeros((1, 2)), 0.1).mean())"
    )
    home = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null", "PATH": ""}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env=home, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == 1.0
