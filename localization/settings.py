"""Settings by name, such as ``registration.normal_noise``: from a command line, a file or a Python mapping.

A name is the path of a field of ``LocalizerConfig``. Values are checked here for type, shape and sign, and by the
configuration's own classes for everything else.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import is_dataclass
from difflib import get_close_matches
from enum import EnumMeta
from pathlib import Path
from typing import Any, Final, cast, get_args, get_origin, get_type_hints

from localization.config import LocalizerConfig, from_json, to_json
from localization.errors import LocalizationError

_CONFIG_KEY: Final = "localizer"
"""Key of a run folder's ``config.json`` that holds the localiser's settings."""
_NEAREST: Final = 3
"""Number of similar names that an error lists."""
_BOOLEANS: Final = {"true": True, "yes": True, "false": False, "no": False}


class SettingError(LocalizationError):
    """A setting that does not exist, or a value that it cannot have; one line names it and what would work."""


def with_settings(config: LocalizerConfig, values: Mapping[str, object]) -> LocalizerConfig:
    """Return a configuration with other values for some of its settings.

    Args:
        config: Configuration that supplies all other settings.
        values: Values by dotted name, such as ``{"registration.normal_noise": 0.15}``, or as nested mappings,
            such as ``{"registration": {"normal_noise": 0.15}}``. Texts are converted to the setting's type.

    Raises:
        SettingError: If there is no setting of a name, or a value has another type, shape or sign than the
            setting, or the configuration rejects it.
    """
    kinds = setting_types()
    plain = to_json(config)
    for name, value in flattened(values):
        if name not in kinds:
            raise SettingError(_unknown(name, kinds))
        *groups, last = name.split(".")
        group = plain
        for part in groups:
            group = group[part]
        group[last] = _converted(name, kinds[name], value)
    try:
        return from_json(LocalizerConfig, plain)
    except (LocalizationError, TypeError, ValueError) as error:
        raise SettingError(f"settings: {error}") from error


def read_settings(path: Path | str) -> dict[str, object]:
    """Return the settings in a file: TOML, or the ``config.json`` of a run's folder.

    Raises:
        SettingError: If the file cannot be read, or is of neither format.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
        values = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except OSError as error:
        raise SettingError(f"settings {path}: {error.strerror}") from error
    except ValueError as error:
        kind = "JSON" if path.suffix == ".json" else "TOML"
        raise SettingError(f"settings {path}: is not {kind}: {error}") from error
    if isinstance(values, dict) and isinstance(values.get(_CONFIG_KEY), dict):
        values = values[_CONFIG_KEY]
    if not isinstance(values, dict):
        raise SettingError(f"settings {path}: must be a table of settings by name")
    return dict(flattened(values))


def assignments(words: Iterable[str]) -> dict[str, object]:
    """Return the settings in texts such as ``registration.normal_noise=0.15``; the last one of a name counts.

    Raises:
        SettingError: If a text lacks the sign of equality or the name.
    """
    found: dict[str, object] = {}
    for word in words:
        name, sign, value = word.partition("=")
        if not sign or not name.strip():
            raise SettingError(
                f"settings are given as NAME=VALUE, such as registration.normal_noise=0.15, got {word!r}"
            )
        found[name.strip()] = value.strip()
    return found


def flattened(values: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield nested settings as dotted names with their values."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from flattened(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def setting_types(kind: type = LocalizerConfig, prefix: str = "") -> dict[str, Any]:
    """Return the type of each setting by its dotted name."""
    found: dict[str, Any] = {}
    for name, hint in get_type_hints(kind).items():
        if is_dataclass(hint):
            found |= setting_types(cast("type", hint), f"{prefix}{name}.")
        else:
            found[f"{prefix}{name}"] = hint
    return found


def _unknown(name: str, kinds: Mapping[str, Any]) -> str:
    """Return what to say of a name that no setting has: the settings most like it."""
    last = name.rsplit(".", 1)[-1]
    group = name[: len(name) - len(last)]
    same = [known for known in kinds if known.rsplit(".", 1)[-1] == last]
    beside = [
        f"{group}{end}" for end in get_close_matches(last, _ends(group, kinds), _NEAREST, 0.7)
    ]
    inside = [known for known in kinds if known.startswith(f"{name}.")]
    near = same or inside or beside or get_close_matches(name, kinds, n=_NEAREST, cutoff=0.5)
    if not near:
        ends = {known.rsplit(".", 1)[-1]: known for known in kinds}
        near = [ends[e] for e in get_close_matches(last, ends, n=_NEAREST, cutoff=0.5)]
    listed = ", ".join(near[:_NEAREST])
    hint = f"; nearest: {listed}" if listed else "; docs/settings.md lists them"
    return f"there is no setting {name!r}{hint}"


def _ends(group: str, kinds: Mapping[str, Any]) -> list[str]:
    """Return the names of the settings of a group, without the group's."""
    return [known.removeprefix(group) for known in kinds if known.startswith(group)]


def _converted(name: str, kind: Any, value: object) -> object:
    """Return a value as the plain value of a setting's type."""
    if get_origin(kind) is tuple:
        return _sequence(name, kind, value)
    if kind is bool:
        if isinstance(value, bool):
            return value
        if isinstance(value, str) and value.lower() in _BOOLEANS:
            return _BOOLEANS[value.lower()]
        raise SettingError(f"{name} must be true or false, got {value!r}")
    if isinstance(kind, EnumMeta):
        known = [member.value for member in cast("Iterable[Any]", kind)]
        if value not in known:
            raise SettingError(f"{name} must be one of {', '.join(known)}, got {value!r}")
        return value
    if kind is int or kind is float:
        return _number(name, kind, value)
    return value


def _sequence(name: str, kind: Any, value: object) -> tuple[object, ...]:
    if isinstance(value, str):
        value = [part for part in value.strip("[]() ").replace(",", " ").split() if part]
    if not isinstance(value, list | tuple):
        raise SettingError(f"{name} must be a list of numbers, got {value!r}")
    kinds = get_args(kind)
    # A tuple of any length in the type has the length of its default.
    size = len(_default(name)) if len(kinds) == 2 and kinds[1] is Ellipsis else len(kinds)
    if len(value) != size:
        raise SettingError(f"{name} must be {size} numbers, got {len(value)}")
    each = [kinds[0]] * size if Ellipsis in kinds else list(kinds)
    return tuple(_converted(name, k, v) for k, v in zip(each, value, strict=True))


def _number(name: str, kind: type, value: object) -> int | float:
    """Return a number that a setting can have: all of them are sizes, which are not negative."""
    what = "a whole number" if kind is int else "a finite number"
    try:
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise ValueError
        number = float(value)
        if not math.isfinite(number) or (kind is int and number != int(number)):
            raise ValueError
    except ValueError:
        raise SettingError(f"{name} must be {what}, got {value!r}") from None
    if number < 0.0:
        raise SettingError(f"{name} must be {what} >= 0, got {value}")
    return int(number) if kind is int else number


def _default(name: str) -> tuple[object, ...]:
    value: Any = LocalizerConfig()
    for part in name.split("."):
        value = getattr(value, part)
    return tuple(value)
