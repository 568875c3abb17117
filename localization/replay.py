"""One call on a log: readings in a file, estimates out."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar, cast, get_type_hints

from localization.cloud import load_cloud
from localization.localizer import Localizer, LocalizerConfig
from localization.log import Log, LogError, read_log
from localization.prepared import prepare
from localization.types import SECOND, Estimate, HintVerdict

CONFIG_KEY = "localizer"
"""Metadata of a log under which the localiser's configuration is kept, as JSON."""

_T = TypeVar("_T")


def replay(log: Log, localizer: Localizer) -> Iterator[Estimate]:
    """Feed a log to a localiser and yield its estimate each time that time has moved on."""
    stamp = 0
    for reading in log:
        estimate = localizer.add(reading)
        if estimate.stamp > stamp:
            stamp = estimate.stamp
            yield estimate


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Localized:
    """What localising a log came to."""

    estimates: tuple[Estimate, ...]
    """One each time that time has moved on."""
    verdicts: tuple[HintVerdict, ...]
    """The answers to the log's hints."""
    notes: tuple[str, ...]
    """What there is to know about the log: readings refused, messages passed over, a broken end."""


def localize(
    log_path: Path | str,
    map_path: Path | str,
    *,
    cache: Path | None = None,
    progress: Callable[[float, str], None] = lambda share, text: None,
) -> Localized:
    """Localise a whole log in a map, configured as the log says it was recorded.

    Args:
        log_path: an MCAP log with scans, wheel speeds, inertial readings and at least one hint.
        map_path: the cloud, as PLY.
        cache: folder for the prepared map; None prepares it anew.
        progress: told the share done, as far as it is known, and a line of text.

    Raises:
        LogError: if the log cannot be read.
        CloudError: if the cloud cannot serve as a map.
    """
    log = read_log(log_path)
    cloud = load_cloud(map_path)
    config = config_of(log)
    localizer = Localizer(prepare(cloud, cache=cache), log.mounts, config)
    estimates, refusals = [], {}
    for estimate in replay(log, localizer):
        estimates.append(estimate)
        refusals.update(dict.fromkeys(r for r in estimate.reasons if r.startswith("refused")))
        if estimate.stamp % (10 * SECOND) == 0:
            progress(0.0, f"{estimate.stamp // SECOND} s, {estimate.health}")
    notes = [log.warning] if log.warning else []
    recorded = log.metadata.get("map_sha256", cloud.sha256)
    if recorded != cloud.sha256:
        notes.append(
            f"the log was recorded with another map ({recorded[:12]}, not {cloud.sha256[:12]})"
        )
    notes += [f"{s.count} messages on {t} passed over: {s.reason}" for t, s in log.skipped.items()]
    if localizer.refused:
        notes.append(f"{localizer.refused} readings refused, such as: {next(iter(refusals), '')}")
    verdicts = tuple(e.verdict for e in estimates if e.verdict is not None)
    return Localized(tuple(estimates), verdicts, tuple(notes))


def config_of(log: Log) -> LocalizerConfig:
    """Return the configuration a log was recorded with, or the default if it has none.

    Raises:
        LogError: if the log holds one that this version does not understand.
    """
    text = log.metadata.get(CONFIG_KEY)
    if text is None:
        return LocalizerConfig()
    try:
        return from_json(LocalizerConfig, json.loads(text))
    except (TypeError, ValueError) as error:
        raise LogError(f"{log.path}: its localiser configuration is not ours: {error}") from error


def config_metadata(config: LocalizerConfig) -> dict[str, str]:
    """Return the metadata by which a log remembers the configuration it was recorded with."""
    return {CONFIG_KEY: json.dumps(to_json(config))}


def to_json(config: Any) -> dict[str, Any]:
    """Return a configuration dataclass as plain values."""
    return dataclasses.asdict(config)


def from_json(kind: type[_T], values: dict[str, Any]) -> _T:
    """Build a configuration dataclass from plain values; unknown names are refused."""
    hints = get_type_hints(kind)
    unknown = sorted(set(values) - set(hints))
    if unknown:
        raise ValueError(f"unknown setting {unknown[0]!r} of {kind.__name__}")
    given = {
        name: from_json(cast("type[Any]", hints[name]), value)
        if dataclasses.is_dataclass(hints[name])
        else tuple(value)
        if isinstance(value, list)
        else value
        for name, value in values.items()
    }
    return kind(**given)
