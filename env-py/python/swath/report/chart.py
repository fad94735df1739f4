"""Charts as SVG that is part of the page: lines with intervals, and rows of distributions or differences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from swath.styles import style

__all__ = ["Frame", "Scale", "colour", "dashes", "marker", "swatch", "ticks"]


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


def colour(number: int) -> str:
    """Returns the class that gives an element the colour of a style."""
    return f"c{style(number).colour}"


def dashes(number: int) -> str:
    """Returns the dash of a style, as SVG writes it."""
    return " ".join(map(str, style(number).dash))


def marker(number: int, x: float, y: float, title: str = "", size: float = 4.0) -> str:
    """Returns the mark of a style, in its colour; `title` is shown when it is pointed at."""
    d, s = size, 0.8 * size
    square = f"M{x - s:g} {y - s:g}h{2 * s:g}v{2 * s:g}h{-2 * s:g}z"
    diamond = f"M{x} {y - 1.25 * d:g}l{d:g} {1.25 * d:g}l{-d:g} {1.25 * d:g}l{-d:g} {-1.25 * d:g}z"
    upright = f"M{x - d:g} {y}h{2 * d:g}M{x} {y - d:g}v{2 * d:g}"
    slanted = f"M{x - s:g} {y - s:g}l{2 * s:g} {2 * s:g}M{x - s:g} {y + s:g}l{2 * s:g} {-2 * s:g}"
    shape = {
        "circle": f'<circle cx="{x}" cy="{y}" r="{d:g}"/>',
        "triangle": f'<path d="M{x} {y - d:g}l{d:g} {2 * s:g}h{-2 * d:g}z"/>',
        "square": f'<path d="{square}"/>',
        "diamond": f'<path d="{diamond}"/>',
        "wedge": f'<path d="M{x} {y + d:g}l{d:g} {-2 * s:g}h{-2 * d:g}z"/>',
        "plus": f'<path d="{upright}" class="open"/>',
        "cross": f'<path d="{slanted}" class="open"/>',
        "bar": f'<path d="M{x} {y - d:g}v{2 * d:g}" class="open"/>',
        "ring": f'<circle cx="{x}" cy="{y}" r="{d:g}" class="hollow"/>',
        "box": f'<path d="{square}" class="hollow"/>',
        "star": f'<path d="{upright}{slanted}" class="open"/>',
        "kite": f'<path d="{diamond}" class="hollow"/>',
    }[style(number).mark]
    told = f"<title>{escape(title)}</title>" if title else ""
    return f'<g class="mark {colour(number)}">{told}{shape}</g>'


def swatch(number: int) -> str:
    """Returns a short piece of the line of a style with its mark, for a legend."""
    line = f'<line x1="0" y1="8" x2="30" y2="8" class="run {colour(number)}" stroke-dasharray="{dashes(number)}"/>'
    return f'<svg width="30" height="16" aria-hidden="true">{line}{marker(number, 15, 8)}</svg>'
