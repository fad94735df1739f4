"""Charts as SVG that is part of the page: lines with intervals, and rows of distributions or differences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

__all__ = ["MARKERS", "Frame", "Scale", "marker", "swatch", "ticks"]

MARKERS = ("circle", "triangle", "square", "diamond", "wedge", "plus", "cross", "bar")
DASHES = ("", "7 3", "2 3", "9 3 2 3", "4 4", "12 3", "1 2", "7 2 2 2 2 2")


def ticks(low: float, high: float, wanted: int) -> list[float]:
    """Returns round numbers between two limits, about as many as wanted."""
    raw = (high - low) / wanted
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= raw * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(number * step, 10) for number in range(first, last + 1)]


class Scale:
    """From values to pixels, straight or logarithmic."""

    def __init__(self, low: float, high: float, start_px: float, end_px: float, *, is_log: bool = False) -> None:
        """Makes a scale; `low` lands on `start_px`, `high` on `end_px`."""
        self.low, self.high, self.is_log = low, high, is_log
        self._start_px, self._end_px = start_px, end_px

    def __call__(self, value: float) -> float:
        """Returns where a value lands, pixels."""
        low, high, at = ((math.log(number) if self.is_log else number) for number in (self.low, self.high, value))
        share = 0.5 if high == low else (at - low) / (high - low)
        return round(self._start_px + share * (self._end_px - self._start_px), 1)


class Frame:
    """An SVG with axes, to which marks are added."""

    def __init__(self, width_px: int, height_px: int, label: str, kind: str) -> None:
        """Begins a picture of the style `kind`; `label` says to screen readers what it shows."""
        self._head = (
            f'<svg viewBox="0 0 {width_px} {height_px}" width="{width_px}" height="{height_px}" class="{kind}" '
            f'role="img" aria-label="{escape(label)}">'
        )
        self._parts: list[str] = []

    def add(self, part: str) -> None:
        """Adds an element."""
        self._parts.append(part)

    def line(self, x1: float, y1: float, x2: float, y2: float, kind: str) -> None:
        """Adds a straight line of the style `kind`."""
        self.add(f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" class="{kind}"/>')

    def text(self, x: float, y: float, text: str, kind: str = "middle", turn: str = "") -> None:
        """Adds text, aligned as `kind` says: start, middle or end."""
        self.add(f'<text x="{x}" y="{y}" class="{kind}"{turn}>{escape(text)}</text>')

    def x_axis(self, scale: Scale, y_px: float, marks: Sequence[float], label: str, *, top_px: float) -> None:
        """Adds an axis below, with lines up to `top_px`."""
        for mark in marks:
            self.line(scale(mark), y_px, scale(mark), top_px, "grid")
            self.text(scale(mark), y_px + 15, f"{mark:g}")
        self.line(scale(scale.low), y_px, scale(scale.high), y_px, "axis")
        self.text(0.5 * (scale(scale.low) + scale(scale.high)), y_px + 33, label)

    def y_axis(self, scale: Scale, x_px: float, marks: Sequence[float], label: str, *, right_px: float) -> None:
        """Adds an axis at the left, with lines up to `right_px`."""
        for mark in marks:
            self.line(x_px, scale(mark), right_px, scale(mark), "grid")
            self.text(x_px - 6, scale(mark) + 4, f"{mark:g}", "end")
        self.line(x_px, scale(scale.low), x_px, scale(scale.high), "axis")
        middle = 0.5 * (scale(scale.low) + scale(scale.high))
        self.text(13, middle, label, "middle", f' transform="rotate(-90 13 {middle})"')

    def svg(self) -> str:
        """Returns the picture."""
        return self._head + "".join(self._parts) + "</svg>"


def marker(agent: int, x: float, y: float, title: str = "", size: float = 4.0) -> str:
    """Returns an agent's mark: a colour and a shape of its own; `title` is shown when it is pointed at."""
    kind = agent % len(MARKERS)
    d, s = size, 0.8 * size
    shape = {
        "circle": f'<circle cx="{x}" cy="{y}" r="{d:g}"/>',
        "triangle": f'<path d="M{x} {y - d}l{d} {2 * s}h{-2 * d}z"/>',
        "square": f'<path d="M{x - s} {y - s}h{2 * s}v{2 * s}h{-2 * s}z"/>',
        "diamond": f'<path d="M{x} {y - 1.25 * d}l{d} {1.25 * d}l{-d} {1.25 * d}l{-d} {-1.25 * d}z"/>',
        "wedge": f'<path d="M{x} {y + d}l{d} {-2 * s}h{-2 * d}z"/>',
        "plus": f'<path d="M{x - d} {y}h{2 * d}M{x} {y - d}v{2 * d}" class="open"/>',
        "cross": f'<path d="M{x - s} {y - s}l{2 * s} {2 * s}M{x - s} {y + s}l{2 * s} {-2 * s}" class="open"/>',
        "bar": f'<path d="M{x} {y - d}v{2 * d}" class="open"/>',
    }[MARKERS[kind]]
    told = f"<title>{escape(title)}</title>" if title else ""
    return f'<g class="mark c{kind}">{told}{shape}</g>'


def swatch(agent: int) -> str:
    """Returns a short piece of an agent's line with its mark, for a legend."""
    kind = agent % len(DASHES)
    line = f'<line x1="0" y1="8" x2="30" y2="8" class="run c{kind}" stroke-dasharray="{DASHES[kind]}"/>'
    return f'<svg width="30" height="16" aria-hidden="true">{line}{marker(agent, 15, 8)}</svg>'
