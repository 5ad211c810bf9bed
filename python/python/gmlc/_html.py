"""How objects show themselves in a notebook."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._fit import Deviations, Fit, Inspection
    from ._model import Model

#: The largest report that is put into the notebook itself; larger ones are linked.
_MOST_BYTES = 8_000_000


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    cells = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>"


def _number(x: float | None, digits: int = 6) -> str:
    return "" if x is None or not math.isfinite(x) else f"{x:.{digits}g}"


def _pair(value: float | None, sd: float | None) -> tuple[str, str]:
    """A value with the decimals that leave two digits of its standard deviation, and that."""
    if value is None or sd is None or not (math.isfinite(value) and 0 < sd < math.inf):
        return _number(value), _number(sd, 2)
    decimals = min(9, max(0, 1 - math.floor(math.log10(sd))))
    return f"{value:.{decimals}f}", f"{sd:.{decimals}f}"


def _verdict(outcome: str) -> str:
    return escape(outcome) if outcome in ("", "conforms") else _bad(outcome)


def _bad(text: str) -> str:
    return f'<span style="color:#b3261e;font-weight:600">{escape(text)}</span>'


def _warnings(warnings: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{escape(w)}</li>" for w in warnings) + "</ul>" if warnings else ""


def model(model: Model) -> str:
    rows = (
        (escape(p.name), _number(p.default), _number(p.lower), _number(p.upper), p.unit, escape(p.doc))
        for p in model.parameters.values()
    )
    table = _table(["parameter", "default", "from", "to", "unit", ""], rows)
    parts = ", ".join(escape(part) for part in model.parts)
    return f"<b>{escape(model.name)}</b>{table}parts: {parts}"


def fit(fit: Fit) -> str:
    def row(p: Any) -> tuple[str, ...]:
        value, sd = _pair(p.value, p.sd)
        return (escape(p.name), value, sd or escape(p.without_sd or ""), p.unit)

    rows = [row(p) for p in fit.values()] + [row(m) for m in fit.measures.values()]
    doubt = _bad(f"not to be relied on: {fit.shortcoming}") if fit.shortcoming else ""
    name = escape(str(fit.data["model"]))
    return f"<b>{name}</b> {doubt}{_table(['', 'value', 'sd', 'unit'], rows)}{_warnings(fit.warnings)}"


def deviations(deviations: Deviations) -> str:
    report = deviations.report

    def row(name: str, part: dict[str, Any], verdict: str) -> tuple[str, ...]:
        figures = (part["signed"]["mean"], part["rms"], part["percentiles"]["p95"], part["max"])
        shown = (_number(x, 3) for x in figures)
        return (escape(name), f"{100 * part['coverage']:.1f} %", *shown, _verdict(verdict))

    def measure(m: dict[str, Any]) -> tuple[str, ...]:
        value, uncertainty = _pair(m["value"], m["uncertainty"])
        allowed = f"{_number(m['nominal'] + m['lower'])} to {_number(m['nominal'] + m['upper'])}"
        return (escape(m["name"]), value, uncertainty, m["unit"], allowed, _verdict(m["outcome"]))

    # The verdict on everything is that above: it is of parts and of measures.
    rows = [row("all", report, "")]
    rows += [row(part["name"], part, (part.get("verdict") or {}).get("outcome", "")) for part in report["parts"]]
    tables = _table(["part", "coverage", "mean mm", "rms mm", "95 % mm", "max mm", "verdict"], rows)
    if report.get("measures"):
        head = ["measure", "value", "uncertainty", "unit", "allowed", "verdict"]
        tables += _table(head, [measure(m) for m in report["measures"]])
    return f"<b>{_verdict(deviations.verdict or '')}</b>{tables}{_warnings(deviations.warnings)}"


def inspection(inspection: Inspection) -> str:
    page = inspection.page
    link = f'<a href="{escape(page.as_posix(), quote=True)}">{escape(page.as_posix())}</a>'
    try:
        if page.stat().st_size > _MOST_BYTES:
            return link
        text = page.read_text(encoding="utf-8")
    except OSError:
        return link
    frame = f'<iframe srcdoc="{escape(text, quote=True)}" sandbox="allow-scripts" width="100%" height="720"></iframe>'
    return link + frame
