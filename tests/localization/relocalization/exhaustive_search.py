"""Exhaustive correlative search of a window (Olson 2009): slow, and the oracle of branch and bound."""

from __future__ import annotations

import numpy as np

from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig
from localization.matching.scan_consistency import BeamClassifier
from localization.relocalization.branch_and_bound import MapSearchConfig
from localization.relocalization.floor_plan import FloorPlan, level_points
from localization.relocalization.refinement import best_places, refined_places
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import Window
from localization.relocalization.search_work import SearchWork
from localization.relocalization.verification import Weighing
from localization.types import Pose, Sweep


def exhaustive_search(
    sweep: Sweep,
    world: PreparedMap,
    plan: FloorPlan,
    window: Window,
    level: Pose,
    config: SearchConfig = SearchConfig(),  # noqa: B008  (frozen)
) -> SearchWork:
    """Search a window; yields the amount of each piece of work and returns the places found.

    Args:
        sweep: points in ``base_link`` at one instant.
        world: the prepared cloud.
        plan: its floor plan at the horizontal scanner's height.
        window: where to look.
        level: a pose whose height, roll and pitch the robot has on level ground; x, y and yaw are not
            used.
        config: steps and thresholds.

    Returns:
        Distinct places, best first, each with the share of the sweep that it explains.
    """
    flat = level_points(sweep, level)
    if len(flat) < 10:
        return ()
    most = min(MapSearchConfig().beams, len(flat))
    flat = flat[np.linspace(0, len(flat) - 1, most).astype(int)]

    steps = np.arange(
        -np.ceil(window.half_width / config.step), window.half_width / config.step + 1
    )
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2) * config.step
    places = grid + [window.x, window.y]
    turns = int(np.ceil(window.half_yaw / config.step_yaw))
    yaws = window.yaw + config.step_yaw * np.arange(-turns, turns + 1, dtype=np.float64)
    scores = np.empty((len(yaws), len(places)))
    for i, yaw in enumerate(yaws):
        c, s = np.cos(yaw), np.sin(yaw)
        scores[i] = score(plan, flat @ np.array([[c, s], [-s, c]]), places)
        yield len(places) * len(flat)

    heading, place = np.divmod(np.arange(scores.size), len(places))
    peaks = best_places(
        scores.ravel(), places[place], yaws[heading], config, most=MapSearchConfig().refine
    )
    registration, weighing = RegistrationConfig(), Weighing(BeamClassifier(world))
    return (yield from refined_places(sweep, world, peaks, level, config, registration, weighing))


def score(plan: FloorPlan, points: FloatArray, places: FloatArray) -> FloatArray:
    """Return for each place (M, 2) how well points (B, 2), turned already, lie on surfaces."""
    at = places[:, None, :] + points[None, :, :]
    limit = np.array(plan.likelihood.shape) - 1
    cell = np.clip(((at - plan.origin) / plan.cell).astype(np.int64), 0, limit)
    scores = plan.likelihood[cell[..., 0], cell[..., 1]].mean(axis=1)
    own = np.clip(((places - plan.origin) / plan.cell).astype(np.int64), 0, limit)
    free: FloatArray = np.where(plan.free[own[:, 0], own[:, 1]], scores, 0.0)
    return free
