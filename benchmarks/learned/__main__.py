"""Takes over a finished training, plays its policy on held-out instances beside others, and writes data and tables.

`make train-learned` trains and calls it, first with `--export`, since `learned` holds its weights when it is compiled.
`make retrain-learned` trains once more from another seed and calls it with `--again`, which only judges that policy.
`python -m benchmarks.learned --tables` writes the tables anew from the data that is there.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.learned import page
from benchmarks.learned.results import AGAIN, AGENTS, export, play, play_again


def main() -> None:
    """Runs everything."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.learned", description=__doc__)
    run, folder = Path("out/learned/maskable-routing"), Path("agents/learned")
    parser.add_argument("--run", type=Path, default=run, help="the training (default: %(default)s)")
    parser.add_argument("--to", type=Path, default=folder, help="data and page (default: %(default)s)")
    parser.add_argument("--instances", type=int, default=100, help="held-out instances (default: %(default)s)")
    parser.add_argument("--agents", default=",".join(AGENTS), help="who plays; others stay (default: %(default)s)")
    parser.add_argument("--export", action="store_true", help="only take over model, weights and curve")
    parser.add_argument("--again", type=Path, metavar="RUN", help="only judge the policy of another training")
    parser.add_argument("--tables", action="store_true", help="only write the tables anew")
    arguments = parser.parse_args()
    if arguments.export:
        export(arguments.run, arguments.to / arguments.run.name)
        return
    if arguments.again:
        play_again(arguments.again, arguments.to / AGAIN, arguments.instances)
    for agent in [] if arguments.tables or arguments.again else arguments.agents.split(","):
        play(agent, arguments.to / "contest", arguments.instances)
    page.write(arguments.to / "README.md", arguments.to)
    print(f"wrote {arguments.to / 'README.md'}")


if __name__ == "__main__":
    main()
