"""A picture of every agent's path, replays, and the rule that every agent and every environment has a page."""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from scripts.site.marks import ENVIRONMENT_PAGES, MarkError, agents

import swath
from swath.film import write_film
from swath.registration import ENTRY_POINTS
from swath.replay import page_of

SCENARIO, SEED = "pasture", 7
SIZE = (1280, 720)


def pictures() -> Iterator[tuple[str, bytes]]:
    """Yields, for every agent of the registry, where on the site its picture lies, and the picture as a PNG file."""
    for name, *_ in agents():
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "path.png"
            write_film([swath.run_episode(name, scenario=SCENARIO, seed=SEED)], file, size=SIZE)
            yield f"agents/paths/{name}.png", file.read_bytes()


def replay(names: Sequence[str]) -> str:
    """Returns the replay of agents as a page."""
    return page_of([swath.run_episode(name, scenario=SCENARIO, seed=SEED) for name in names])


def check_pages(pages: Collection[str]) -> None:
    """Makes sure that no page is missing.

    Raises:
        MarkError: If an agent or an environment of the registry has no page.
    """
    needed = {f"the agent `{name}`": f"agents/{name}.md" for name, *_ in agents()}
    needed |= {f"the environment `{env_id}`": ENVIRONMENT_PAGES.get(env_id, "") for env_id in ENTRY_POINTS}
    for what, page in needed.items():
        if page not in pages:
            text = f"{what} has no page: docs/{page or 'environments'}"
            raise MarkError(text)
