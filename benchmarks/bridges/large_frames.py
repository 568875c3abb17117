"""Large frames for a server: garbage of many kinds, and messages that are just large."""

from __future__ import annotations

import json

import numpy as np
import pybase64

from benchmarks.bridges.servers import POINTS

ARRAYS = "[" + "[]," * 333_000 + "[]]"
KEYS = ",".join(f'"{i:06d}":1' for i in range(90_000))


def _stick(fields: str) -> str:
    return f'{{"op":"publish","topic":"/joy","msg":{{{fields}}}}}'


def _publish(topic: str, message: object) -> str:
    return json.dumps({"op": "publish", "topic": topic, "msg": message})


GARBAGE: dict[str, str | bytes] = {
    "2401 brackets": "{" * 2401,
    "16 kB of empty arrays as axes": _stick(f'"axes":[{"[]," * 5400}[]]'),
    "1 MB of brackets": "[" * 999_999,
    "1 MB of nested objects": '{"a":' * 199_999,
    "1 MB of empty arrays": ARRAYS,
    "1 MB of empty arrays as axes": _stick(f'"axes":{ARRAYS}'),
    "1 MB of empty arrays in no known op": f'{{"op":"no","msg":{ARRAYS}}}',
    "1 MB of empty objects as poses": (
        f'{{"op":"publish","topic":"/path","msg":{{"poses":[{"{}," * 333_000}{{}}]}}}}'
    ),
    "1 MB of keys as a stick": _stick(KEYS),
    "1 MB of one string as axes": _stick(f'"axes":"{"x" * 999_900}"'),
    "1 MB of digits as an axis": _stick(f'"axes":[{"1" * 999_900}]'),
    "1 MB of letters": "x" * 999_999,
    "1 MB of blanks": " " * 999_999,
    "half a million empty objects": "{}" * 499_999,
    "1 MB of random bytes": np.random.default_rng(0).bytes(999_999),
    "1 MB of CBOR": b"\x9f" + b"\x80" * 999_998,
}

_HEADER = {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "map"}
_PLACE = {"x": 1.2345, "y": 2.3456, "z": 0.0}
_TURN = {"x": 0.0, "y": 0.0, "z": 0.38268, "w": 0.92388}
_POSE = {"header": _HEADER, "pose": {"position": _PLACE, "orientation": _TURN}}
_TRANSFORM = {
    "header": _HEADER,
    "child_frame_id": "a",
    "transform": {"translation": _PLACE, "rotation": _TURN},
}

LARGE: dict[str, str | bytes] = {
    "a Path of 10 000 poses": _publish("/path", {"poses": [_POSE] * 10_000}),
    "1000 transforms": _publish("/tf", {"transforms": [_TRANSFORM] * 1000}),
    "a cloud as a list of 300 000 numbers": _publish(
        "/points", {"data": POINTS[:300_000].tolist()}
    ),
    "a cloud of 740 kB in base64": _publish(
        "/points", {"data": pybase64.b64encode_as_string(POINTS[:740_000].tobytes())}
    ),
}
