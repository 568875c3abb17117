"""Replay of a log: readings in a file, estimates out, in one call."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from localization.config import (
    LocalizerConfig,
    from_json,
    known_settings,
    to_json,
    unknown_settings,
)
from localization.logs.continuity import LogContinuity
from localization.logs.frame_tree import SensorLayout
from localization.logs.log_interface import LogError, ReadingsLog, require_scanner
from localization.logs.open_log import open_log
from localization.maps.cloud import Cloud
from localization.maps.map_files import load_map
from localization.maps.prepared_map import prepare
from localization.motion.sensor_configuration import SensorConfiguration
from localization.pipeline.dead_reckoning_run import DeadReckoningRun
from localization.pipeline.localizer import Localizer
from localization.settings import flattened, with_settings
from localization.types import (
    SECOND,
    Estimate,
    Health,
    Hint,
    HintVerdict,
    Mounts,
    PointScan,
    Pose,
    Reading,
    Scan,
    Verdict,
)

CONFIG_KEY = "localizer"
"""Key of a log's metadata that holds the localiser's configuration, as JSON."""


def replay(
    log: Iterable[Reading],
    localizer: Localizer,
    *,
    start: Pose | None = None,
    refused: Callable[[str], None] = lambda reason: None,
) -> Iterator[Estimate]:
    """Feed a log to a localiser and yield its estimate each time that time advances.

    Args:
        log: readings in the order of arrival.
        localizer: processes them.
        start: ``map_from_base`` about where the log begins: given as a hint, and again from where odometry
            has led since, until one is accepted, or while the search that follows a rejection is under way.
            The log's own hints are then skipped: they may refer to another map, and each would replace the
            other before it is answered.
        refused: called with the reason when a reading is rejected, also at an instant without an estimate.
    """
    stamp, hinted, rejected, begun = 0, False, False, Pose.identity()
    for reading in log:
        if start is not None and isinstance(reading, Hint):
            continue
        before = localizer.refused
        estimate = localizer.add(reading)
        if localizer.refused > before:
            refused(next((r for r in estimate.reasons if r.startswith("refused")), "no reason"))
        if estimate.verdict is not None:
            hinted, rejected = False, estimate.verdict.verdict is Verdict.REJECTED
        rejected = rejected and estimate.health is Health.RELOCALISING
        if start is not None and not hinted and isinstance(reading, Scan | PointScan):
            if not stamp:
                begun = estimate.odom_from_base
            if estimate.map_from_base is None and not rejected:
                here = start @ (begun.inverse() @ estimate.odom_from_base)
                estimate = localizer.add(Hint(reading.stamp, here, np.zeros((6, 6))))
                hinted = True
        if estimate.stamp > stamp:
            stamp = estimate.stamp
            yield estimate


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Localized:
    """Result of localising a log."""

    estimates: tuple[Estimate, ...]
    """One estimate each time that time advanced."""
    verdicts: tuple[HintVerdict, ...]
    """The answers to the log's hints."""
    notes: tuple[str, ...]
    """Remarks about the log: rejected readings, skipped messages, a broken end."""


class LogRun:
    """A log on its way through the localiser, for logs of any length: no estimate is kept.

    Iterate it once; afterwards ``notes`` is complete.
    """

    log: ReadingsLog
    cloud: Cloud
    localizer: Localizer
    mounts: dict[str, Pose]
    """``base_from_scanner`` of each scanner, as used."""
    verdicts: list[HintVerdict]
    """The answers to the log's hints so far."""

    def __init__(
        self,
        log_path: Path | str | ReadingsLog,
        map_path: Path | str,
        *,
        sensors: SensorConfiguration | None = None,
        start: Pose | None = None,
        layout: SensorLayout | None = None,
        mounts: Mounts | None = None,
        inside: npt.ArrayLike | None = None,
        settings: Mapping[str, object] | None = None,
        cache: Path | None = None,
    ) -> None:
        """Open log and map; see ``localize``, and ``load_cloud`` for ``inside``.

        Raises:
            LogError: if the log cannot be read, or has no scanner; see ``open_run``.
            CloudError: if the cloud cannot serve as a map.
            SettingError: if a setting does not exist, or cannot have the value.
        """
        self.log = open_log(log_path, layout) if isinstance(log_path, Path | str) else log_path
        require_scanner(self.log)
        self.mounts = {**self.log.mounts, **(mounts or {})}
        # Before the map is loaded, which may take a while.
        config = configured(self.log, sensors, settings)
        self._left_out = settings_left_out(self.log) if sensors is None else ()
        self.cloud = load_map(map_path, inside=inside, cache=cache)
        self.localizer = Localizer(prepare(self.cloud, cache=cache), self.mounts, config)
        self._start = start
        self.verdicts = []
        self._refusal: str | None = None
        self._continuity = LogContinuity(self.log)

    @property
    def config(self) -> LocalizerConfig:
        """All settings, as used."""
        return self.localizer.config

    def __iter__(self) -> Iterator[Estimate]:
        """Yield the estimate each time that time advances."""
        if self._start is None and not self.log.metadata:
            # A foreign log rarely contains a hint.
            self.localizer.relocalize()
        for estimate in replay(
            self._readings(), self.localizer, start=self._start, refused=self._refused
        ):
            if estimate.verdict is not None:
                self.verdicts.append(estimate.verdict)
            yield estimate

    def _readings(self) -> Iterator[Reading]:
        for reading in self.log:
            self._continuity.observe(reading)
            yield reading

    def _refused(self, reason: str) -> None:
        self._refusal = self._refusal or reason

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks about the log: rejected readings, skipped messages, a broken end."""
        log, refused = self.log, self.localizer.refused
        notes = [*log.warnings, *(f"{log.path}: {note}" for note in self._continuity.notes)]
        if self._left_out:
            notes.append(
                f"recorded by another version; settings left out: {', '.join(self._left_out)}"
            )
        recorded = log.metadata.get("map_sha256", self.cloud.sha256)
        if recorded != self.cloud.sha256:
            notes.append(
                "the log was recorded with another map "
                f"({recorded[:12]}, not {self.cloud.sha256[:12]})"
            )
        notes += [f"{s.count} messages on {t} skipped: {s.reason}" for t, s in log.skipped.items()]
        if refused:
            notes.append(f"{refused} readings refused, such as: {self._refusal}")
        return tuple(notes)


def open_run(
    log_path: Path | str,
    map_path: Path | str | None = None,
    *,
    sensors: SensorConfiguration | None = None,
    start: Pose | None = None,
    layout: SensorLayout | None = None,
    mounts: Mounts | None = None,
    inside: npt.ArrayLike | None = None,
    settings: Mapping[str, object] | None = None,
    cache: Path | None = None,
) -> LogRun | DeadReckoningRun:
    """Return a log on its way through the localiser; through dead reckoning without a scanner or without a map.

    Args as in ``localize``, and ``inside`` as in ``load_cloud``.

    Raises:
        LogError: if the log cannot be read, or holds nothing that moves.
        CloudError: if the cloud cannot serve as a map.
        SettingError: if a setting does not exist, or cannot have the value.
    """
    log = open_log(log_path, layout)
    if log.mounts and map_path is not None:
        return LogRun(
            log,
            map_path,
            sensors=sensors,
            start=start,
            mounts=mounts,
            inside=inside,
            settings=settings,
            cache=cache,
        )
    config = configured(log, sensors, settings)
    cloud = None if map_path is None else load_map(map_path, inside=inside, cache=cache)
    if sensors is None and _of_sensors(settings):
        sensors = config.sensors
    return DeadReckoningRun(log, config, cloud=cloud, start=start, sensors=sensors)


def localize(
    log_path: Path | str,
    map_path: Path | str | None = None,
    *,
    sensors: SensorConfiguration | None = None,
    start: Pose | None = None,
    layout: SensorLayout | None = None,
    mounts: Mounts | None = None,
    settings: Mapping[str, object] | None = None,
    cache: Path | None = None,
    progress: Callable[[float, str], None] = lambda share, text: None,
) -> Localized:
    """Localise a whole log in a map, configured as the log says it was recorded.

    A log without scanner, or any log without a map, is dead-reckoned instead; see ``DeadReckoningRun``.

    Args:
        log_path: a log of ours, a ROS bag or a CARMEN text. The start of a foreign one is searched for in
            the whole map, unless ``start`` is given.
        map_path: the cloud, or a ROS occupancy grid, by its ``map.yaml``; None for dead reckoning.
        sensors: which sensors to use; those of the log unless given.
        start: ``map_from_base`` about where the log begins, in place of the log's own hints.
        layout: how the robot is built, as far as a bag does not define it.
        mounts: ``base_from_scanner`` of scanners, instead of the log's; see ``mount_file``.
        settings: values of settings by name, such as ``{"registration.normal_noise": 0.15}``; the others
            are the log's own, or suit its sensors. See ``localization.settings``.
        cache: folder for data derived from the map; None derives it anew.
        progress: called with the share of the log that is read, and a line of text.

    Raises:
        LogError: if the log cannot be read.
        CloudError: if the cloud cannot serve as a map.
        SettingError: if a setting does not exist, or cannot have the value.
    """
    run = open_run(
        log_path,
        map_path,
        sensors=sensors,
        start=start,
        layout=layout,
        mounts=mounts,
        settings=settings,
        cache=cache,
    )
    estimates: list[Estimate] = []
    reported = 0
    for estimate in run:
        estimates.append(estimate)
        if estimate.stamp >= reported + 10 * SECOND:
            reported = estimate.stamp
            since = (reported - estimates[0].stamp) // SECOND
            progress(run.log.share, f"{since} s of the log, {estimate.health}")
    return Localized(tuple(estimates), tuple(run.verdicts), run.notes)


def configured(
    log: ReadingsLog,
    sensors: SensorConfiguration | None,
    settings: Mapping[str, object] | None,
) -> LocalizerConfig:
    """Return the configuration for a log: its own or that of the given sensors, with other values for some settings.

    Raises:
        LogError: if the log holds a configuration that cannot be read.
        SettingError: if a setting does not exist, or cannot have the value.
    """
    values = dict(flattened(settings or {}))
    config = config_of(log) if sensors is None else LocalizerConfig.of(sensors)
    if of_sensors := _of_sensors(settings):
        # The noise of the filter follows from the sensors.
        config = LocalizerConfig.of(with_settings(config, of_sensors).sensors)
    return with_settings(config, values) if values else config


def _of_sensors(settings: Mapping[str, object] | None) -> dict[str, object]:
    """Return those of the settings that say which sensors are used."""
    return {name: value for name, value in flattened(settings or {}) if name.startswith("sensors.")}


def config_of(log: ReadingsLog) -> LocalizerConfig:
    """Return the configuration with which a log was recorded, or the one for its sensors if it has none.

    Settings that this version does not have are left out; see ``settings_left_out``.

    Raises:
        LogError: if the log holds one that cannot be read.
    """
    values = _settings(log)
    if values is None:
        return LocalizerConfig.of(log.sensors)
    try:
        return from_json(LocalizerConfig, known_settings(LocalizerConfig, values))
    except (TypeError, ValueError) as error:
        raise LogError(f"{log.path}: its localiser configuration is not ours: {error}") from error


def settings_left_out(log: ReadingsLog) -> tuple[str, ...]:
    """Return which of a log's settings this version does not have, such as ``ekf.track``."""
    values = _settings(log)
    return () if values is None else tuple(unknown_settings(LocalizerConfig, values))


def _settings(log: ReadingsLog) -> dict[str, Any] | None:
    """Return the settings in a log's metadata as plain values; None if it has none."""
    text = log.metadata.get(CONFIG_KEY)
    if text is None:
        return None
    try:
        values = json.loads(text)
    except ValueError as error:
        raise LogError(f"{log.path}: its localiser configuration is not ours: {error}") from error
    if not isinstance(values, dict):
        raise LogError(f"{log.path}: its localiser configuration is not ours: no JSON object")
    return values


def config_metadata(config: LocalizerConfig) -> dict[str, str]:
    """Return the metadata that keeps a configuration in a log."""
    return {CONFIG_KEY: json.dumps(to_json(config))}
