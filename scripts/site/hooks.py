"""Hooks of mkdocs: marks, formulas and links of a page become what a browser shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File
from scripts.site import paths
from scripts.site.formulas import with_mathml
from scripts.site.links import with_links
from scripts.site.marks import DATA_FILES, ROOT, MarkError, address_of, expand, races_in

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Adds the pictures and the replays, and refuses a site in which an agent or an environment has no page."""
    for name, address in DATA_FILES.items():
        files.append(File.generated(config, address, abs_src_path=str(ROOT / name)))
    try:
        for source, picture in paths.pictures():
            files.append(File.generated(config, source, content=picture))
        races = {race for page in files.documentation_pages() for race in races_in(page.content_string)}
        for race in sorted(races):
            files.append(File.generated(config, address_of(race), content=paths.replay(race)))
        paths.check_pages(files.src_uris)
    except MarkError as error:
        raise PluginError(str(error)) from error
    return files


def on_page_markdown(markdown: str, *, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Puts in what marks stand for, then turns formulas into MathML and links out of the site into plain text."""
    try:
        text = expand(markdown, page.file.src_uri)
    except MarkError as error:
        message = f"{page.file.src_uri}: {error}"
        raise PluginError(message) from error
    return with_mathml(with_links(text, page.file.src_uri)).replace(" ± ", "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}")
