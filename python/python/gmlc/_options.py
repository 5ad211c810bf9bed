"""Keyword arguments as the words of a command line, whose names and values are those of the command."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from . import _gmlc

#: What an option takes, by its name: as the command's help has it (``LENGTH``), None for a flag.
Options = Mapping[str, "str | None"]

_READING, _FITTING, _MEASURING, _SCANNING = (dict(group) for group in _gmlc.option_names())

#: The units of plain numbers.
_UNITS = {"LENGTH": "mm", "TOLERANCE": "mm", "ANGLE": "rad"}

#: Options that the functions of this package have under another name, or that make no sense in them.
_LEFT_OUT = {"trace", "output", "format", "json", "params", "truth", "param", "input"}

READING = {k: v for k, v in _READING.items() if k not in _LEFT_OUT}
FITTING = {k: v for k, v in _FITTING.items() if k not in _LEFT_OUT or k == "param"}
MEASURING = {k: v for k, v in _MEASURING.items() if k not in _LEFT_OUT}
SCANNING = {k: v for k, v in _SCANNING.items() if k not in _LEFT_OUT - {"format"}}
REPORT: Options = {"report-field": "NAME=TEXT"}
COMPILING: Options = {"input": "NAME=VALUE", "limit": "NAME=N", "allow-path": "FOLDER"}


def words(options: Mapping[str, Any], *groups: Options, units: Mapping[str, str] | None = None) -> list[list[str]]:
    """The words of each group of options; a TypeError names an option that is in none of them. ``units`` are those of
    the model's parameters."""
    result: list[list[str]] = [[] for _ in groups]
    for key, value in options.items():
        name = key.replace("_", "-")
        known = [i for i, group in enumerate(groups) if name in group]
        if not known:
            names = sorted({n.replace("-", "_") for group in groups for n in group})
            near = difflib.get_close_matches(key, names, 1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise TypeError(f"there is no option {key!r}{hint}")
        for i in known:
            result[i].extend(_word(name, value, groups[i][name], units or {}))
    return result


def _word(name: str, value: Any, kind: str | None, units: Mapping[str, str]) -> Iterable[str]:
    if value is None or value is False:
        return
    if kind is None:
        if value is not True:
            raise TypeError(f"{name.replace('-', '_')} is True or False, not {value!r}")
        yield f"--{name}"
    elif isinstance(value, Mapping):
        for key, one in value.items():
            yield f"--{name}={key}={_text(one, units.get(key, ''))}"
    elif isinstance(value, (list, tuple)):
        for one in value:
            yield f"--{name}={_text(one, _UNITS.get(kind, ''))}"
    elif value is True:
        raise TypeError(f"{name.replace('-', '_')} needs a value")
    else:
        yield f"--{name}={_text(value, _UNITS.get(kind, ''))}"


def _text(value: Any, unit: str = "") -> str:
    """A value as the command has it: numbers in millimetres and radians."""
    if isinstance(value, (bool, np.bool_)):
        return str(value).lower()
    if isinstance(value, (int, np.integer)):
        return f"{int(value)}{unit}"
    return f"{float(value)!r}{unit}" if isinstance(value, (float, np.floating)) else str(value)


def length(value: Any) -> str:
    """A length as the command has it: numbers in millimetres."""
    return _text(value, _UNITS["LENGTH"])


def pairs(values: Mapping[str, Any], units: Mapping[str, str]) -> list[tuple[str, str]]:
    """Values of parameters as the command has them; plain numbers are in millimetres and radians."""
    return [(name, _text(value if isinstance(value, str) else float(value), units.get(name, ""))) for name, value in values.items()]
