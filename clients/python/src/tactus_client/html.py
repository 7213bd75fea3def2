"""What notebooks show: pictures of images and tables of facts, as HTML without scripts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape as escape
from typing import Any

#: A picture's colours never span less than this, so that noise stays pale.
SPAN_MIN_COUNTS = 50.0


def image(rows: Any, caption: str) -> str:
    """A picture of rows x columns with their numbers; row 0 is at the bottom, as on the sensor."""
    rows = [[float(value) for value in row] for row in rows]
    values = [value for row in rows for value in row]
    low = min(values, default=0.0)
    span = max(max(values, default=0.0) - low, SPAN_MIN_COUNTS)
    lines = []
    for row in reversed(rows):
        cells = "".join(_cell(value, (value - low) / span) for value in row)
        lines.append(f"<tr>{cells}</tr>")
    return (
        f'<table style="border-collapse:collapse;font-size:11px"><caption style="caption-side:bottom;text-align:left">'
        f"{escape(caption)}</caption>{''.join(lines)}</table>"
    )


def card(title: str, facts: dict[str, Any], simulated: bool, warnings: Iterable[str] = (), below: str = "") -> str:
    """A title, facts by name, warnings, and something below."""
    mark = ' <strong style="background:#fc3;color:#000;padding:0 .4em">SIMULATED</strong>' if simulated else ""
    rows = "".join(f"<tr><th>{escape(name.replace('_', ' '))}</th><td>{_text(value)}</td></tr>" for name, value in facts.items())
    told = "".join(f'<p style="color:#b00"><strong>Note:</strong> {escape(warning)}</p>' for warning in warnings)
    return f"<div><strong>{escape(title)}</strong>{mark}<table>{rows}</table>{told}{below}</div>"


def table(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Rows under a header."""
    head = "".join(f"<th>{escape(name)}</th>" for name in header)
    body = "".join(f"<tr>{''.join(f'<td>{_text(value)}</td>' for value in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cell(value: float, share: float) -> str:
    lightness = 96 - 60 * min(max(share, 0.0), 1.0)
    colour = "#fff" if lightness < 60 else "#000"
    style = f"background:hsl(205,75%,{lightness:.0f}%);color:{colour};text-align:center;width:3.2em;height:2.4em"
    return f'<td style="{style}">{value:.0f}</td>'


def _text(value: Any) -> str:
    return "" if value is None else escape(str(value))
