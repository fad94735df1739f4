"""The report itself: one file, which asks nobody for anything."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING

from swath.evaluation.chance import without_interval
from swath.replay.data import data_of
from swath.replay.page import document, json_block, script, style
from swath.report import tables
from swath.report.chart import swatch
from swath.report.extremes import SUCCESSES, Extreme, drawn, extremes_of, ratio_percent
from swath.report.figures import MEASURES, axis_label, differences, distributions, over_value
from swath.report.groups import Group, groups_of
from swath.share import share
from swath.styles import YARDSTICK, is_yardstick, title_of

if TYPE_CHECKING:
    from swath.episode import Episode
    from swath.report.evaluated import Evaluated

__all__ = ["page_of", "steps_of"]


def steps_of(evaluated: Evaluated) -> int:
    """Returns how often `page_of` says that it has come further."""
    groups = groups_of(evaluated)
    return len(groups) + len(list(extremes_of(groups)))


def page_of(evaluated: Evaluated, advance: Callable[[int], None] = lambda _: None) -> str:
    """Returns a report.

    Statistics are worked out here, so the size of the page does not depend on the number of episodes.

    Args:
        evaluated: A finished evaluation.
        advance: Told 1 after each of `steps_of` steps.

    Returns:
        HTML that needs no other file and no network.
    """
    groups = groups_of(evaluated)
    sections = []
    for number, group in enumerate(groups):
        sections.append(_section(group, number))
        advance(1)
    replays = _replays(groups, advance)
    title = f"Evaluation of {', '.join(map(title_of, evaluated.agents))}"
    links = [*((f"group-{number}", group.name) for number, group in enumerate(groups)), *_PARTS]
    contents = "".join(f'<li><a href="#{name}">{escape(text)}</a></li>' for name, text in links)
    body = (
        f"<header><h1>{escape(title)}</h1>\n{_about(evaluated)}\n"
        f'<nav aria-label="Contents"><ul>{contents}</ul></nav></header>\n<main>\n'
        + "".join(sections)
        + replays
        + _origin(evaluated)
        + f"</main>\n<script>{script()}\n{_file('report.js')}</script>\n"
    )
    return document(title, style() + _file("report.css"), body)


_PARTS = (("replays", "Best and worst episodes"), ("origin", "How it came about"))


def _about(evaluated: Evaluated) -> str:
    episodes = evaluated.path_m.size
    last = evaluated.seed + evaluated.instances - 1
    agents, places = _count(len(evaluated.agents), "agent"), _count(len(evaluated.places), "scenario")
    yardsticks = "".join(
        f'<p class="about"><i>{escape(label)}</i>: a {escape(YARDSTICK)}.</p>'
        for label in evaluated.agents
        if is_yardstick(label)
    )
    counts = f"{_count(episodes, 'episode')}: {agents} on {places}, {_count(evaluated.instances, 'instance')} each"
    seeds = f"seeds {evaluated.seed} to {last}" if last > evaluated.seed else f"seed {last}"
    return (
        f'<p class="about">{counts}, {seeds}, the same for every agent. '
        "Paths are in per cent of the boustrophedon path over the whole pasture; shorter is better. "
        "Intervals hold the mean with 95&nbsp;% confidence, by Student's t over instances; those of means are cut at "
        "what cannot be: below 0, and for weeds mowed above 100&nbsp;%.</p>" + yardsticks
    )


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def _section(group: Group, number: int) -> str:
    evaluated = group.evaluated
    measured = {"path": evaluated.path_percent, "mowed": evaluated.mowed_percent}
    parts = [f'<section id="group-{number}"><h2>{escape(group.name)}</h2>\n{_what(group)}']
    parts.append(tables.of_group(group))
    if group.panels:
        along = axis_label(group.key or "")
        parts.append(f"<h3>Mean over {escape(along)}, with 95&nbsp;% intervals</h3>\n{_legend(evaluated)}")
        figures = [over_value(group, panel, name, measured[name]) for panel in group.panels for name in MEASURES]
        parts.append(_figures(figures))
    parts.append("<h3>Distributions</h3>\n")
    parts.append(
        '<p class="about">Each hill is a histogram of all episodes of an agent. Below it: the middle 90&nbsp;% as a '
        "line, the median as a stroke, the mean as the agent's mark. Each row has a scale of its own, from none to the "
        "most episodes that lie in one of its bars.</p>\n"
    )
    parts.append(_figures([distributions(group, name, values) for name, values in measured.items()]))
    if len(evaluated.agents) > 1:
        parts.append(
            f"<h3>In pairs: the same weeds, {escape(evaluated.versus)} beside each</h3>\n"
            f'<p class="about">{escape(evaluated.versus)} is the reference: each row shows by how much an agent has '
            "more (right of 0) or less (left of 0), the mean over instances of its value minus the reference's.</p>\n"
        )
        parts.append(_figures([differences(group, name, values) for name, values in measured.items()]))
        parts.append(
            '<p class="about">&#9660; the row\'s path is shorter, &#9650; it is longer, &#9671; the interval holds 0: '
            "not decided. Points of per cent of the boustrophedon path.</p>\n" + tables.matrix(group)
        )
    if len(group.numbers) > 1:
        parts.append(
            f"<details><summary>Every scenario: {len(group.numbers)}</summary>\n{tables.of_places(group)}</details>\n"
        )
    return "".join(parts) + "</section>\n"


def _what(group: Group) -> str:
    """Returns what the means of a group are over, and where they have no interval."""
    evaluated, several = group.evaluated, len(group.numbers) > 1
    texts = []
    if several:
        averaged = f" The figures average over {' and '.join(group.averaged)}." if group.averaged and group.key else ""
        texts.append(f"Means over {len(group.numbers)} scenarios, taken instance by instance.{averaged}")
    reasons = Counter(evaluated.places[number].same_weeds for number in group.numbers)
    for reason, count in reasons.items():
        if reason is not None and evaluated.instances > 1:
            where = f"In {count} of {len(group.numbers)} scenarios " if several else ""
            text = f"{where}{without_interval(reason, evaluated.agents, evaluated.instances)}."
            texts.append(text[0].upper() + text[1:])
    return "".join(f'<p class="about">{escape(text)}</p>\n' for text in texts)


def _legend(evaluated: Evaluated) -> str:
    entries = "".join(
        f"<li>{swatch(look)} {tables.name_of(label)}</li>"
        for look, label in zip(evaluated.styles, evaluated.agents, strict=True)
    )
    return f'<ul class="legend" aria-label="Legend">{entries}</ul>\n'


def _figures(pictures: Sequence[str]) -> str:
    return '<div class="figures">' + "".join(f"<figure>{picture}</figure>" for picture in pictures) + "</div>\n"


def _replays(groups: Sequence[Group], advance: Callable[[int], None]) -> str:
    evaluated = groups[0].evaluated
    parts = [
        '<section id="replays"><h2>Best and worst episodes</h2>\n<p class="about">The shortest and the longest path of '
        "each agent, in per cent of its own mean in that scenario: so none is best because its pasture is easy. An "
        "episode that failed is worse than all others, and the more so the fewer weeds it mowed. Each is driven again "
        "from its seed, beside "
        f"{escape(evaluated.versus)} on the same weeds. Open "
        "one to play it: space plays and pauses, the arrow keys go along the path and change the speed.</p>\n"
    ]
    name = ""
    for number, extreme in enumerate(extremes_of(groups)):
        if len(groups) > 1 and evaluated.places[extreme.place].name != name:
            name = evaluated.places[extreme.place].name
            parts.append(f"<h3>{escape(name)}</h3>\n")
        parts.append(_replay(evaluated, extreme, f"replay-{number}", drawn(evaluated, extreme)))
        advance(1)
    return "".join(parts) + "</section>\n"


def _replay(evaluated: Evaluated, extreme: Extreme, name: str, episodes: Sequence[Episode]) -> str:
    place, at = evaluated.places[extreme.place], (extreme.place, extreme.agent, extreme.instance)
    swept = "".join(f", {key} = {value}" for key, value in place.values.items())
    label = title_of(evaluated.agents[extreme.agent])
    outcome = evaluated.outcomes[at]
    failure = "" if outcome in SUCCESSES else f", {outcome}"
    own = ratio_percent(evaluated, extreme.agent)[extreme.place, extreme.instance]
    title = (
        f"{label}, {extreme.kind}: {evaluated.path_percent[at]:.1f} % path, {own:.0f} % of its mean there, "
        f"{share(evaluated.mowed_percent[at], 1, whole=100.0)} % mowed{failure} "
        f"({place.name}{swept}, seed {evaluated.seed + extreme.instance})"
    )
    summary = f"<summary>{swatch(evaluated.styles[extreme.agent])} {escape(title)}</summary>"
    if not episodes:
        reason = "It cannot be driven again from this folder: its scenario or its agent is not there."
        return f'<details class="replay">{summary}<p>{reason}</p></details>\n'
    note = ""
    if episodes[0].path_length_m != evaluated.path_m[at]:
        note = (
            f'<p class="about">This build of swath drives {episodes[0].path_length_m:.1f} m here, where the evaluation '
            f"has {evaluated.path_m[at]:.1f} m: it is another build, or the agent has a "
            "time budget, with which decisions depend on the machine.</p>"
        )
    block = json_block(
        name, data_of(episodes, [evaluated.styles[evaluated.agents.index(episode.agent)] for episode in episodes])
    )
    return f'<details class="replay" data-replay="{name}">{summary}{note}<div class="player"></div></details>\n{block}'


def _origin(evaluated: Evaluated) -> str:
    known = {"swath": evaluated.version, **evaluated.origin}
    rows = [[escape(key), f"<code>{escape(value)}</code>"] for key, value in known.items()]
    if "command" not in evaluated.origin:
        rows.append(["the same rows again", f"<code>{escape(_command(evaluated))}</code>"])
    hashes = "".join(f"<li>{escape(place.name)} <code>{place.hash[:16]}</code></li>" for place in evaluated.places)
    scenarios = "".join(
        f"<details><summary>{escape(name)}</summary><pre>{escape(text)}</pre></details>\n"
        for name, text in evaluated.files.items()
    )
    return (
        f'<section id="origin"><h2>How it came about</h2>\n{tables.table(["", ""], rows)}'
        f"<h3>Scenarios, every key written out</h3>\n{scenarios}"
        f"<details><summary>Hash of every scenario</summary><ul>{hashes}</ul></details>\n"
        "</section>\n"
    )


def _command(evaluated: Evaluated) -> str:
    """Returns a command that gives the same rows, from the scenario files beside them."""
    names = [str(evaluated.folder / name) for name in evaluated.files]
    only = ["--only", evaluated.only] if evaluated.only else []
    options = ["--agents", ",".join(evaluated.agents), *only, "--instances", str(evaluated.instances)]
    return shlex.join(
        ["swath", "evaluate", *names, *options, "--seed", str(evaluated.seed), "--versus", evaluated.versus]
    )


@cache
def _file(name: str) -> str:
    return files("swath.report").joinpath(name).read_text("utf-8")
