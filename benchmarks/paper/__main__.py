"""Runs the experiments of the paper and writes data, figures and page.

`make paper` calls it. A stopped run goes on where it stopped.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.paper import figures, page
from benchmarks.paper.runs import EXPERIMENTS, run


def main() -> None:
    """Runs everything."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper", description=__doc__)
    parser.add_argument(
        "--episodes", type=Path, default=Path("out/paper"), help="episodes of each experiment (default: %(default)s)"
    )
    parser.add_argument(
        "--docs", type=Path, default=Path("docs/reproduce"), help="page, figures and data (default: %(default)s)"
    )
    parser.add_argument("--jobs", type=int, default=None, help="threads (default: all cores)")
    arguments = parser.parse_args()

    runs = {experiment.name: run(experiment, arguments.episodes, arguments.jobs) for experiment in EXPERIMENTS}
    by_name = {experiment.name: experiment for experiment in EXPERIMENTS}
    folder = arguments.docs / "cowbot-2022"
    figures.save(figures.density(by_name["density"], runs["density"]), folder, "figure-6")
    radius = [(by_name["turning-radius"], runs["turning-radius"])]
    figures.save(figures.sweep(radius), folder, "figure-7")
    sensor = [(by_name[name], runs[name]) for name in ("sensor-width", "sensor-range")]
    figures.save(figures.sweep(sensor), folder, "figure-8")
    page.write(arguments.docs / "cowbot-2022.md", folder, runs, "make paper")
    print(f"wrote {arguments.docs / 'cowbot-2022.md'} and {folder}")


if __name__ == "__main__":
    main()
