"""Inner loops, compiled to machine code: they are what a sweep's time goes to.

A loop calls only loops of its own file: what numba keeps on disk is renewed when the file changes that a loop is in,
whatever changed in files of what it calls. They count nothing in parallel and reorder no sums, so that a result repeats
to the bit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

_Loop = TypeVar("_Loop", bound=Callable[..., Any])


def compiled(loop: _Loop) -> _Loop:
    """Compile a loop when it is called first, and keep that beside its file or in the user's cache folder.

    Where neither can be written, each process compiles anew, which takes some seconds.
    """
    try:
        return cast(_Loop, numba.njit(cache=True, error_model="numpy")(loop))
    except RuntimeError:
        return cast(_Loop, numba.njit(error_model="numpy")(loop))
