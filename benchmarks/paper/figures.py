"""The paper's figures 6, 7 and 8, drawn from the episodes."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
from benchmarks.paper.runs import ONLINE, Experiment, Runs
from matplotlib.axes import Axes
from matplotlib.figure import Figure

mpl.use("Agg")

# Okabe & Ito's palette, told apart by colour-blind readers too, and a marker for each agent.
STYLES = {
    "bcp": ("#000000", "s"),
    "bcp:spacing=sensor": ("#999999", "D"),
    "bcp-tsp": ("#56B4E9", "v"),
    "react": ("#E69F00", "P"),
    "jump": ("#0072B2", "o"),
    "snake": ("#D55E00", "^"),
    "r-snake": ("#009E73", "x"),
}
NAMES = {"bcp:spacing=sensor": "search sweep"}
MEASURES = {"path": "path length, % of bcp", "mowed": "weeds mowed, %"}
AXES = {
    "weeds.count": "number of weeds",
    "mower.turning_radius_m": "turning radius R, m",
    "sensor.width_m": "sensor width $S_w$, m",
    "sensor.range_m": "sensor range $S_d$, m",
}


def density(experiment: Experiment, runs: Runs) -> Figure:
    """Figure 6: path length and weeds mowed over the number of weeds, both distributions."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
    for axes, measure in ((left, "path"), (right, "mowed")):
        for agent in experiment.agents:
            if measure == "mowed" and agent == "bcp:spacing=sensor":
                continue
            for distribution, line in (("uniform", "-"), ("gaussian", "--")):
                _line(axes, experiment, runs, agent, measure, line, weeds__distribution=distribution)
        _finish(axes, experiment, measure)
        axes.set_xscale("log", base=2)
        axes.set_xticks(runs.values("weeds.count"), [f"{count:.0f}" for count in runs.values("weeds.count")])
    handles, labels = left.get_legend_handles_labels()
    uniform = [(handle, label) for handle, label in zip(handles, labels, strict=True) if not label.startswith("_")]
    figure.legend(*zip(*uniform, strict=True), loc="outside lower center", ncols=7, frameon=False)
    left.set_title("(a) solid: uniform, dashed: Gaussian", fontsize=10)
    right.set_title("(b) solid: uniform, dashed: Gaussian", fontsize=10)
    return figure


def sweep(experiments: list[tuple[Experiment, Runs]]) -> Figure:
    """Figures 7 and 8: path length and weeds mowed over a parameter, averaged over weed counts and distributions."""
    figure, grid = plt.subplots(
        len(experiments), 2, figsize=(11, 4 * len(experiments)), layout="constrained", squeeze=False
    )
    panels = iter("abcdefgh")
    for (experiment, runs), row in zip(experiments, grid, strict=True):
        for axes, measure in zip(row, ("path", "mowed"), strict=True):
            for agent in ONLINE:
                _line(axes, experiment, runs, agent, measure, "-")
            _finish(axes, experiment, measure)
            axes.set_title(f"({next(panels)})", fontsize=10)
            axes.legend(frameon=False)
    return figure


def save(figure: Figure, folder: Path, name: str) -> None:
    """Writes a figure as PNG and SVG, the same bytes for the same data."""
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / f"{name}.png", dpi=110, metadata={"Software": None})
    with mpl.rc_context({"svg.hashsalt": name}):
        figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
    plt.close(figure)


def _line(axes: Axes, experiment: Experiment, runs: Runs, agent: str, measure: str, line: str, **where: str) -> None:
    assert experiment.axis is not None, "an experiment with a figure has an axis"
    key = experiment.axis.replace(".", "__")
    points = runs.values(experiment.axis)
    means = [runs.mean(agent, measure, **{key: point}, **where) for point in points]
    colour, marker = STYLES[agent]
    label = NAMES.get(agent, agent) if line == "-" else "_"
    axes.errorbar(
        points,
        [mean.value for mean in means],
        yerr=[mean.half_width for mean in means],
        color=colour,
        marker=marker,
        linestyle=line,
        markersize=5,
        # SNAKE's line is the wider one, since R-SNAKE's often lies on it.
        linewidth=3 if agent == "snake" else 1.4,
        alpha=0.7 if agent == "snake" else 1,
        capsize=2,
        label=label,
    )


def _finish(axes: Axes, experiment: Experiment, measure: str) -> None:
    assert experiment.axis is not None, "an experiment with a figure has an axis"
    axes.set_xlabel(AXES[experiment.axis])
    axes.set_ylabel(MEASURES[measure])
    axes.grid(visible=True, color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
