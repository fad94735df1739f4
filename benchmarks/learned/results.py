"""The data: a training's curve, and episodes of all contestants on instances that nobody has trained or tuned on."""

from __future__ import annotations

import csv
import os
import platform
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import swath
from swath.evaluation.row import Row
from swath.training import Curve, RandomPlayer, evaluate_policy, load_policy
from swath.training.curve import POLICY
from swath.training.policy import Player

TRAININGS = ("maskable-routing", "ppo-features")
"""The trainings of `configs/train` whose results are shown."""

SCRIPTED = ("bcp", "jump", "snake")
SEED = 1_000_000
"""Of instance 0; the trainings' own evaluations begin at 1,001,000."""

TRAINED, UNTRAINED, SAMPLED, RANDOM = "trained", "untrained", "untrained, drawing its actions", "random"

COLUMNS = ("agent", "instance", "seed", "weeds_total", "weeds_mowed", "path_length_m", "seen_fraction", "outcome")
CURVE_COLUMNS = ("steps", "wall_s", "instances", "path_m", "path_half_width_m", "weeds_mowed", "weeds_half_width")


def collect(run: Path, folder: Path, instances: int) -> None:
    """Writes `curve.csv`, `episodes.csv`, `machine.txt` and the model of a finished training into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    write_rows(folder / "curve.csv", CURVE_COLUMNS, curve_rows(run))
    rows = [[getattr(row, name) for name in COLUMNS] for row in contest(run, instances)]
    write_rows(folder / "episodes.csv", COLUMNS, rows)
    (folder / "machine.txt").write_text(machine() + "\n", encoding="utf-8")
    for file in run.glob("model*"):
        shutil.copyfile(file, folder / file.name)


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


def contest(run: Path, instances: int) -> Iterator[Row]:
    """Yields the episodes of all contestants on the same instances."""
    trained = load_policy(run / "model.zip")
    assert trained.card is not None, "it was loaded with its card"
    scenario = trained.card.scenario
    players: dict[str, Player] = {
        TRAINED: trained,
        UNTRAINED: load_policy(run / "untrained.zip"),
        SAMPLED: load_policy(run / "untrained.zip", deterministic=False),
        RANDOM: RandomPlayer(trained.model.action_space, SEED),
    }
    for label, player in players.items():
        yield from evaluate_policy(player, scenario=scenario, instances=instances, seed=SEED, label=label)
    yield from swath.evaluate(SCRIPTED, scenario=scenario, instances=instances, seed=SEED).rows


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
