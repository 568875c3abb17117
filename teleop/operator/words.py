"""Words with figures: what stands in braces is a fact, and what stands in brackets is left out without its facts."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final, TypeAlias

from teleop.operator.operating_data import operating_data

Fact: TypeAlias = bool | float | str | None
"""Something that is known, in seconds or degrees; None and an empty text are not known."""
Facts: TypeAlias = Mapping[str, Fact]

_FACT: Final = re.compile(r"\{(\w+)(?::(\w+))?\}")
_OPTIONAL: Final = re.compile(r"\[([^\]]*)\]")


def known(value: Fact) -> bool:
    """Return whether a fact is known."""
    return value is not None and value != ""


def filled(words: str, facts: Facts) -> str:
    """Return words with their facts.

    Args:
        words: ``{name}`` stands for a fact, ``{name:1}`` for one decimal, ``{name:age}`` for a time,
            ``{name:sentence}`` for a sentence.
        facts: What is known.
    """

    def optional(part: re.Match[str]) -> str:
        names = (fact[1] for fact in _FACT.finditer(part[1]))
        return part[1] if all(known(facts.get(name)) for name in names) else ""

    return _FACT.sub(
        lambda fact: _shown(facts.get(fact[1]), fact[2]), _OPTIONAL.sub(optional, words)
    )


def _shown(value: Fact, form: str | None) -> str:
    if value is None:
        return "unknown"
    if form == "age":
        return age_words(float(value))
    if form == "sentence":
        return sentence(str(value))
    return str(value) if form is None else f"{float(value):.{form}f}"


def age_words(age: float) -> str:
    """Return a time [s] as a person says it: ``0.6 s``, ``12 s``, ``3 min``, ``2 h``."""
    said = next(row for row in operating_data("words")["ages"] if age < row["below"])
    return f"{age / said['seconds']:.{said['decimals']}f} {said['unit']}"


def sentence(words: str) -> str:
    """Return words as a sentence of their own."""
    end = "" if words.endswith((".", "!", "?")) else "."
    return f"{words[:1].upper()}{words[1:]}{end}" if words else ""
