"""Runs the experiments of the paper and writes data, figures and page.

`make paper` calls it. A stopped run goes on where it stopped, as long as the build is the same.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.paper import figures, instances, page
from benchmarks.paper.runs import EXPERIMENTS, Runs, run

from swath.files import write_whole


def main() -> None:
    """Runs everything."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper", description=__doc__)
    parser.add_argument(
        "--episodes", type=Path, default=Path("out/paper"), help="finished episodes, by build (default: %(default)s)"
    )
    parser.add_argument(
        "--docs", type=Path, default=Path("docs/reproduce"), help="page, figures and data (default: %(default)s)"
    )
    parser.add_argument("--jobs", type=int, default=None, help="threads (default: all cores)")
    arguments = parser.parse_args()

    folder = arguments.docs / page.DATA
    folder.mkdir(parents=True, exist_ok=True)
    runs: dict[str, Runs] = {}
    for experiment in EXPERIMENTS:
        file = folder / f"{experiment.name}-instances.csv"
        write_whole(file, instances.text(run(experiment, arguments.episodes, arguments.jobs)))
        # What is written is judged, so that the page follows from the files beside it.
        runs[experiment.name] = Runs(instances.read(file))
        write_whole(folder / f"{experiment.name}.csv", page.means(experiment, runs[experiment.name]))
    by_name = {experiment.name: experiment for experiment in EXPERIMENTS}
    figures.save(figures.density(by_name["density"], runs["density"]), folder, "figure-6")
    radius = [(by_name["turning-radius"], runs["turning-radius"])]
    figures.save(figures.sweep(radius), folder, "figure-7")
    sensor = [(by_name[name], runs[name]) for name in ("sensor-width", "sensor-range")]
    figures.save(figures.sweep(sensor), folder, "figure-8")
    write_whole(arguments.docs / "cowbot-2022.md", page.text(runs, "make paper"))
    print(f"wrote {arguments.docs / 'cowbot-2022.md'} and {folder}")


if __name__ == "__main__":
    main()
