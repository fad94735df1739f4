"""The data: a training's curve, and episodes of all contestants on instances that nobody has trained or tuned on."""

from __future__ import annotations

import csv
import os
import platform
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import swath
from swath.training import Curve, evaluate_policy, export_policy, load_policy
from swath.training.curve import POLICY

LEARNED = "learned"
AGENTS = (LEARNED, "snake", "greedy", "horizon", "clairvoyant")
"""The contestants; the last one is a yardstick that is told the weeds."""

COUNTS = (20, 40, 80)
"""Numbers of weeds, uniform on the default pasture."""

SEED = 1_000_000
"""Of instance 0; the training's own evaluations begin at 1,001,000."""

AGAIN = "again.csv"
"""The episodes of a second training's policy on the same instances."""

COLUMNS = (
    "weeds_total", "instance", "seed", "weeds_mowed", "path_length_m", "bcp_length_m",
    "seen_fraction", "outcome", "wall_s",
)  # fmt: skip
CURVE_COLUMNS = ("steps", "wall_s", "instances", "path_m", "path_half_width_m", "weeds_mowed", "weeds_half_width")


def export(run: Path, folder: Path) -> None:
    """Writes `curve.csv`, `machine.txt`, the model of a finished training and its weights into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    write_rows(folder / "curve.csv", CURVE_COLUMNS, curve_rows(run))
    (folder / "machine.txt").write_text(machine() + "\n", encoding="utf-8")
    for file in (*run.glob("model*"), run / "training.toml"):
        shutil.copyfile(file, folder / file.name)
    export_policy(load_policy(folder), folder / "policy.bin")


def play(agent: str, folder: Path, instances: int) -> None:
    """Plays an agent on the held-out instances of every number of weeds, and writes its episodes into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    scenarios = [swath.Scenario("pasture", weeds={"count": count}) for count in COUNTS]
    played = [swath.evaluate([agent], scenario=each, instances=instances, seed=SEED).rows for each in scenarios]
    rows = [[getattr(row, name) for name in COLUMNS] for rows in played for row in rows]
    write_rows(folder / f"{agent}.csv", COLUMNS, rows)


def play_again(run: Path, file: Path, instances: int) -> None:
    """Plays the policy of another finished training on the same instances, and writes its episodes into a file."""
    player = load_policy(run)
    assert player.card is not None, "the card of a policy that was read says what it was trained on"
    rows = []
    for count in COUNTS:
        scenario = swath.Scenario(player.card.scenario, weeds={"count": count})
        rows += evaluate_policy(player, scenario=scenario, instances=instances, seed=SEED)
    write_rows(file, COLUMNS, [[getattr(row, name) for name in COLUMNS] for row in rows])


def curve_rows(run: Path) -> Iterator[list[object]]:
    """Yields a row for each evaluation of the policy while it learned."""
    curve = Curve.read(run / "evaluations.csv")
    with (run / "times.csv").open(encoding="utf-8", newline="") as file:
        wall_s = {int(row["steps"]): row["wall_s"] for row in csv.DictReader(file)}
    for steps in curve.steps:
        path, mowed = curve.path_m(POLICY, steps), curve.weeds_mowed(POLICY, steps)
        spreads = [f"{number:.3f}" for spread in (path, mowed) for number in (spread["mean"], half_width(spread))]
        yield [steps, wall_s[steps], path["n"], *spreads]


def half_width(spread: swath.evaluation.statistics.Spread) -> float:
    """Returns half the 95 % interval of a mean; 0 where there is but one value."""
    return 0.0 if spread["high"] is None else spread["high"] - spread["mean"]


def write_rows(file: Path, header: Sequence[str], rows: Iterator[list[object]] | Sequence[list[object]]) -> None:
    """Writes a CSV file as a whole."""
    temporary = file.with_suffix(".tmp")
    with temporary.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
    temporary.replace(file)


def machine() -> str:
    """Returns the processor, its cores and the versions that matter."""
    import stable_baselines3
    import torch

    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    packages = f"stable-baselines3 {stable_baselines3.__version__}, torch {torch.__version__}"
    return f"{model}, {os.cpu_count()} cores; Python {platform.python_version()}, {packages}, swath {swath.__version__}"
