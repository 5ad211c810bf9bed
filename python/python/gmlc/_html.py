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


def _number(x: float | None) -> str:
    return "" if x is None or not math.isfinite(x) else f"{x:.6g}"


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
        sd = _number(p.sd) if p.sd is not None else escape(p.without_sd or "")
        return (escape(p.name), _number(p.value), sd, p.unit)

    rows = [row(p) for p in fit.values()] + [row(m) for m in fit.measures.values()]
    doubt = _bad(f"not to be relied on: {fit.shortcoming}") if fit.shortcoming else ""
    name = escape(str(fit.data["model"]))
    return f"<b>{name}</b> {doubt}{_table(['', 'value', 'sd', 'unit'], rows)}{_warnings(fit.warnings)}"


def deviations(deviations: Deviations) -> str:
    report = deviations.report

    def row(name: str, part: dict[str, Any]) -> tuple[str, ...]:
        percentiles = part["percentiles"]
        verdict = (part.get("verdict") or {}).get("outcome", "")
        figures = (part["signed"]["mean"], part["rms"], percentiles["p95"], part["max"])
        return (escape(name), f"{100 * part['coverage']:.1f} %", *(_number(x) for x in figures), escape(verdict))

    rows = [row("all", report)] + [row(part["name"], part) for part in report["parts"]]
    head = ["part", "coverage", "mean mm", "rms mm", "95 % mm", "max mm", "verdict"]
    verdict = deviations.verdict
    shown = "" if verdict is None else (escape(verdict) if verdict == "conforms" else _bad(verdict))
    return f"<b>{shown}</b>{_table(head, rows)}{_warnings(deviations.warnings)}"


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
