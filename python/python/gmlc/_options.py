"""Keyword arguments as the words of a command line, whose names and values are those of the command."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

from . import _gmlc

_READING, _FITTING, _MEASURING, _SCANNING = ({name: takes for name, takes in group} for group in _gmlc.option_names())

#: Options that the functions of this package have under another name, or that make no sense in them.
_LEFT_OUT = {"trace", "output", "format", "json", "params", "truth", "param", "input"}

READING = {k: v for k, v in _READING.items() if k not in _LEFT_OUT}
FITTING = {k: v for k, v in _FITTING.items() if k not in _LEFT_OUT or k == "param"}
MEASURING = {k: v for k, v in _MEASURING.items() if k not in _LEFT_OUT}
SCANNING = {k: v for k, v in _SCANNING.items() if k not in _LEFT_OUT - {"format"}}
REPORT = {"report-field": True}
COMPILING = {"input": True, "limit": True, "allow-path": True}


def words(options: Mapping[str, Any], *groups: Mapping[str, bool]) -> list[list[str]]:
    """The words of each group of options; a TypeError names an option that is in none of them."""
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
            result[i].extend(_word(name, value, groups[i][name]))
    return result


def _word(name: str, value: Any, takes_value: bool) -> Iterable[str]:
    if value is None or value is False:
        return
    if not takes_value:
        if value is not True:
            raise TypeError(f"{name.replace('-', '_')} is True or False, not {value!r}")
        yield f"--{name}"
    elif isinstance(value, Mapping):
        for key, one in value.items():
            yield f"--{name}={key}={_text(one)}"
    elif isinstance(value, (list, tuple)):
        for one in value:
            yield f"--{name}={_text(one)}"
    elif value is True:
        raise TypeError(f"{name.replace('-', '_')} needs a value")
    else:
        yield f"--{name}={_text(value)}"


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def pairs(values: Mapping[str, Any], units: Mapping[str, str]) -> list[tuple[str, str]]:
    """Values of parameters as the command has them; plain numbers are in millimetres and radians."""
    result = []
    for name, value in values.items():
        unit = units.get(name, "")
        is_text = isinstance(value, str)
        result.append((name, value if is_text else f"{float(value)!r}{unit}"))
    return result
