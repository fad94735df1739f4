"""Every claim of the paper, beside what the episodes show. A verdict is computed, never typed."""

from __future__ import annotations

import itertools
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from benchmarks.paper import effects
from benchmarks.paper.runs import ONLINE, Mean, Runs, mean_of

COUNTS = (20, 40, 80, 160, 320, 640)
DISTRIBUTIONS = ("uniform", "gaussian")
RADII = (1, 2, 3, 4, 5)
SENSORS = (4, 8, 12, 16, 20)

_DISTRIBUTION = "Gaussian (sigma 3 m) less uniform, paired by seed, in points, where the means differ most"


class Claim(NamedTuple):
    """One row of the page.

    Attributes:
        text: What the paper says.
        where: Where it says it.
        measured: What the episodes show.
        holds: True, False, or None where it holds in part.
    """

    text: str
    where: str
    measured: str
    holds: bool | None


def density_claims(runs: Runs) -> list[Claim]:
    """What the paper says about the number and the distribution of weeds (figure 6)."""
    best = {agent: runs.mean(agent, "path", weeds__count=20) for agent in ONLINE}
    shortest = min(mean.value for mean in best.values())
    grows = {agent: _least_step(runs, agent) for agent in (*ONLINE, "bcp-tsp")}
    dense = {agent: runs.mean(agent, "path", weeds__count=640) for agent in ONLINE}
    uniform = {count: runs.mean("snake", "path", weeds__count=count, weeds__distribution="uniform") for count in COUNTS}
    crossing = [count for count in COUNTS if uniform[count].low > 100]
    react = [runs.mean("react", "mowed", weeds__count=count) for count in COUNTS]
    mowed = {agent: runs.mean(agent, "mowed") for agent in (*ONLINE, "bcp-tsp", "react")}
    detected = runs.mean("r-snake", "detected")
    shorter = runs.difference("r-snake", "snake", "path")
    each = runs.each("r-snake", "path") - runs.each("snake", "path")
    equal, longer = np.mean(np.abs(each) < 1e-9), np.mean(each > 1e-9)
    paths = {agent: effects.of_distribution(runs, agent, "path", COUNTS) for agent in ("bcp-tsp", *ONLINE)}
    shares = {agent: effects.of_distribution(runs, agent, "mowed", COUNTS) for agent in ("bcp-tsp", "react", *ONLINE)}
    sweep = runs.mean("bcp:spacing=sensor", "path")
    blind = 100 - runs.mean("bcp:spacing=sensor", "detected").value
    return [
        Claim(
            "JUMP, SNAKE and R-SNAKE are up to 60 % shorter than BCP at small weed populations",
            "VII-B, figure 6a",
            "at 20 weeds: " + ", ".join(f"{agent} {100 - mean.value:.1f} % shorter" for agent, mean in best.items()),
            100 - shortest >= 58,
        ),
        Claim(
            "The path grows with the number of weeds for all planners",
            "VII-B, figure 6a",
            "smallest step from one weed count to the next, in points on the same instances: "
            + ", ".join(f"{agent} {step:+}" for agent, step in grows.items())
            + "; react always drives the length of bcp",
            True if all(step.low > 0 for step in grows.values()) else None,
        ),
        Claim(
            "SNAKE and R-SNAKE grow beyond BCP as the density rises",
            "VII-B, figure 6a",
            f"snake has passed 100 % at {crossing[0] if crossing else 'no'} uniform weeds; "
            f"at 640, both distributions: snake {dense['snake']} %, r-snake {dense['r-snake']} %",
            dense["snake"].low > 100 and dense["r-snake"].low > 100,
        ),
        Claim(
            "JUMP converges to BCP",
            "VII-B, figure 6a",
            f"at 320 weeds {runs.mean('jump', 'path', weeds__count=320)} %, at 640 {dense['jump']} %",
            abs(dense["jump"].value - 100) < 3,
        ),
        Claim(
            "The spatial distribution does not affect the path length",
            "VII-B, figure 6a",
            f"{_DISTRIBUTION}: {effects.described(paths)}; bcp and react always drive the length of bcp",
            effects.are_absent(paths),
        ),
        Claim(
            "The spatial distribution does not affect the share of weeds mowed",
            "VII-B",
            f"{_DISTRIBUTION}: {effects.described(shares)}; bcp mows every weed",
            effects.are_absent(shares),
        ),
        Claim(
            "REACT's share of mowed weeds drops drastically with density",
            "VII-B, figure 6b",
            f"{react[0]} % at 20 weeds, {react[-1]} % at 640",
            react[-1].high < react[0].low - 20,
        ),
        Claim("JUMP mows 100 %", "VII-B, figure 6b", f"{mowed['jump'].value:.2f} %", mowed["jump"].value >= 99.95),
        Claim(
            "SNAKE mows 99.4 %",
            "VII-B, figure 6b",
            f"{mowed['snake'].value:.2f} %",
            abs(mowed["snake"].value - 99.4) < 0.5,
        ),
        Claim(
            "R-SNAKE mows 97.5 %",
            "VII-B, figure 6b",
            f"{mowed['r-snake'].value:.2f} %",
            abs(mowed["r-snake"].value - 97.5) < 0.5,
        ),
        Claim("R-SNAKE detects about 100 %", "VII-B", f"{detected.value:.2f} %", detected.value >= 99),
        Claim(
            "R-SNAKE's path is consistently shorter than SNAKE's",
            "VII-B",
            f"on the same instances {shorter:+.2f} points; "
            f"equal in {100 * equal:.0f} %, longer in {100 * longer:.1f} %",
            True if equal < 0.05 and longer < 0.01 else (None if shorter.high < 0 else False),
        ),
        Claim(
            "A boustrophedon path with the sensor's width as spacing is the least that any mower must drive",
            "V-B",
            f"the search sweep is {sweep.value:.2f} % long and leaves {blind:.1f} % of the weeds undetected, "
            "so it is not enough to see everything",
            False if blind > 0.5 else None,
        ),
    ]


def _least_step(runs: Runs, agent: str) -> Mean:
    """The smallest growth of an agent's path from one weed count to the next, on the same instances."""
    paths = [runs.by_instance(agent, "path", weeds__count=count) for count in COUNTS]
    return min((mean_of(more - fewer) for fewer, more in pairwise(paths)), key=lambda step: step.value)


def radius_claims(runs: Runs) -> list[Claim]:
    """What the paper says about the turning radius (figure 7)."""
    mowed = [runs.mean("r-snake", "mowed", mower__turning_radius_m=radius) for radius in RADII]
    jump = [runs.mean("jump", "path", mower__turning_radius_m=radius) for radius in RADII]
    return [
        Claim(
            "R-SNAKE mows less as the turning radius grows",
            "VII-B, figure 7b",
            ", ".join(f"R = {radius}: {mean} %" for radius, mean in zip(RADII, mowed, strict=True)),
            mowed[0].low > mowed[-1].high and all(b.value < a.value + 0.5 for a, b in itertools.pairwise(mowed)),
        ),
        Claim(
            "JUMP's path rises abruptly where the radius is very small",
            "VII-B, figure 7a",
            ", ".join(f"R = {radius}: {mean} %" for radius, mean in zip(RADII, jump, strict=True)),
            jump[0].low > max(mean.high for mean in jump[1:]) + 5,
        ),
    ]


def sensor_claims(width: Runs, depth: Runs) -> list[Claim]:
    """What the paper says about the sensor (figure 8)."""
    by_depth = {agent: effects.of_depth(depth, agent, SENSORS) for agent in ONLINE}
    jump = [width.mean("jump", "path", sensor__width_m=s) for s in SENSORS]
    least = min(range(len(SENSORS)), key=lambda i: jump[i].value)
    widths = [width.by_instance("jump", "path", sensor__width_m=s) for s in SENSORS]
    rise = mean_of(widths[-1] - widths[least])
    narrow = width.mean("r-snake", "mowed", sensor__width_m=4)
    shallow = depth.mean("r-snake", "mowed", sensor__range_m=4)
    usual = width.mean("r-snake", "mowed", sensor__width_m=12)
    return [
        Claim(
            "The depth of the field of view has no noticeable effect on the path length",
            "VII-B, figure 8c",
            "longest less shortest mean over S_d = 4 to 20 m, on the same instances, in points: "
            f"{effects.described(by_depth)}",
            effects.are_absent(by_depth),
        ),
        Claim(
            "JUMP's path over the width of the field of view is a parabola",
            "VII-B, figure 8a",
            ", ".join(f"S_w = {s}: {mean} %" for s, mean in zip(SENSORS, jump, strict=True))
            + f"; S_w = 20 less the least, on the same instances: {rise:+.2f} points",
            True if 0 < least < len(SENSORS) - 1 and rise.low > 0 else None,
        ),
        Claim(
            "With a narrow field of view JUMP converges to BCP",
            "VII-B, figure 8a",
            f"S_w = 4: {jump[0]} %",
            abs(jump[0].value - 100) < 5,
        ),
        Claim(
            "A small field of view, narrow or shallow, makes R-SNAKE mow less",
            "VII-B, figures 8b, 8d",
            f"S_w = 4: {narrow} %, S_d = 4: {shallow} %, 12 x 12 m: {usual} %",
            narrow.high < usual.low and shallow.high < usual.low,
        ),
    ]


def field_claims(runs: Runs) -> list[Claim]:
    """What the paper reports of its field experiment (section VIII)."""
    bcp = runs.each("bcp", "length")
    claims = [
        Claim(
            "BCP is 897 m long on the field of 36 x 26 m",
            "VIII",
            f"{bcp[0]:.2f} m",
            bool(abs(bcp[0] - 897) < 1),
        )
    ]
    for agent, printed_m in (("jump", 410), ("snake", 338), ("r-snake", 338)):
        lengths = runs.each(agent, "length")
        percentile = 100 * float(np.mean(lengths <= printed_m))
        claims.append(
            Claim(
                f"{agent.upper()} drove {printed_m} m on one draw of 14 weeds",
                "VIII",
                f"{lengths.mean():.1f} ± {lengths.std(ddof=1):.1f} m (mean ± sd of {lengths.size} draws); "
                f"{printed_m} m is at percentile {percentile:.1f}",
                True if 5 <= percentile <= 95 else (None if 1 <= percentile <= 99 else False),
            )
        )
    for agent in ONLINE:
        mowed = runs.each(agent, "mowed")
        complete = int(np.sum(mowed >= 100 - 1e-9))
        claims.append(
            Claim(
                f"{agent.upper()} mowed all 14 weeds of that draw",
                "VIII",
                f"all 14 in {complete} of {mowed.size} draws ({100 * complete / mowed.size:.1f} %), "
                f"{mowed.mean():.2f} % of all weeds",
                True if complete == mowed.size else (None if complete > mowed.size / 2 else False),
            )
        )
    same = int(np.sum(np.abs(runs.each("snake", "length") - runs.each("r-snake", "length")) < 1e-6))
    claims.append(
        Claim(
            "SNAKE and R-SNAKE drove equally far",
            "VIII",
            f"equal on {same} of {runs.each('snake', 'length').size} draws",
            same > 0.9 * runs.each("snake", "length").size,
        )
    )
    return claims
