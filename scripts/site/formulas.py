"""Formulas in LaTeX, as GitHub writes them, become MathML, which browsers draw without any script."""

from __future__ import annotations

import re

from latex2mathml.converter import convert

_BLOCK = re.compile(r"^( *)```math\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
_INLINE = re.compile(r"\$`([^`\n]+)`\$")


def with_mathml(markdown: str) -> str:
    """Returns a page with every block of the language `math`, and every $`formula`$ in a line, as MathML."""
    markdown = _BLOCK.sub(lambda match: match[1] + _mathml(match[2], "block"), markdown)
    return _INLINE.sub(lambda match: _mathml(match[1], "inline"), markdown)


def _mathml(latex: str, display: str) -> str:
    # A bar would end the cell of a table.
    return str(convert(latex.strip(), display=display)).replace("|", "&#x7C;").replace("\n", "")
