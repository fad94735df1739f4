"""Links between pages of the repository become links between pages of the site."""

from __future__ import annotations

import posixpath
import re

from scripts.site.marks import DATA_FILES, FILE_PAGES

_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
_FENCED = re.compile(r"^(```|~~~).*?^\1$", re.MULTILINE | re.DOTALL)


def with_links(markdown: str, source: str) -> str:
    """Returns a page whose links lead to pages of the site; what is not on the site becomes plain text.

    Args:
        markdown: The page; what another page of the repository was put into it has links seen from that page.
        source: Its path in `docs/`.
    """
    origin = {page: file for file, page in FILE_PAGES.items()}.get(source, f"docs/{source}")
    # Code is left as it is.
    parts, end = [], 0
    for fence in _FENCED.finditer(markdown):
        parts += [_relinked(markdown[end : fence.start()], origin, source), fence[0]]
        end = fence.end()
    return "".join([*parts, _relinked(markdown[end:], origin, source)])


def _relinked(text: str, origin: str, source: str) -> str:
    def replace(link: re.Match[str]) -> str:
        mark, label, target = link.groups()
        path, anchor, fragment = target.partition("#")
        if re.match(r"[a-z][a-z0-9+.-]*:|//|#", target):
            return link[0]
        file = posixpath.normpath(posixpath.join(posixpath.dirname(origin), path))
        page = (FILE_PAGES | DATA_FILES).get(file, file.removeprefix("docs/") if file.startswith("docs/") else None)
        if page is None:
            return label
        return f"{mark}[{label}]({posixpath.relpath(page, posixpath.dirname(source) or '.')}{anchor}{fragment})"

    return _LINK.sub(replace, text)
