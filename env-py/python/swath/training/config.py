"""What a training file says, checked once."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from swath import _native
from swath.errors import ConfigError
from swath.seeds import HELD_OUT_FROM, LARGEST_SEED
from swath.training import keys
from swath.vector import MOST_THREADS

if TYPE_CHECKING:
    from swath.scenario import Scenario

__all__ = ["ALGORITHMS", "RANDOM", "Evaluation", "TrainingConfig", "kind_of", "refuse_endless"]

ALGORITHMS = {"ppo": ("steer", "drive", "discrete", "target"), "sac": ("steer", "drive"), "maskable-ppo": ("target",)}
"""The algorithms, and the action kinds that each can learn."""

RANDOM = "random"
"""Name of the agent that draws its actions uniformly, among the allowed ones where there is a mask."""

_MOST_STEPS = 10**12
_MOST_ENVS = 65_536
_MOST_INSTANCES = 65_536
_MOST_WEEDS = 10_000_000
_KEYS = ("algorithm", "total_steps", "num_envs", "num_threads", "seed", "checkpoint_every", "weed_counts")
_BLOCKS = ("scenario", "policy", "hyperparameters", "normalize", "evaluation")


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """How a policy is evaluated while it learns.

    Attributes:
        every: Steps between two evaluations; the untrained and the final policy are evaluated as well.
        instances: Number of instances; instance i has seed + i, for the policy and for every agent.
        seed: Seed of instance 0, held out.
        agents: Agents to compare with; `random` draws its actions uniformly.
        deterministic: Whether the policy takes its likeliest action; otherwise it draws one.
    """

    every: int
    instances: int
    seed: int
    agents: tuple[str, ...]
    deterministic: bool

    @classmethod
    def check(cls, given: Mapping[str, object]) -> Evaluation:
        """Checks the block `evaluation`.

        Raises:
            ConfigError: For the first key that cannot be used.
        """
        keys.refuse_unknown("evaluation", given, ("every", "instances", "seed", "agents", "deterministic"))
        if "every" not in given:
            text = "`evaluation.every` must be given: the number of steps between two evaluations"
            raise ConfigError(text)
        instances = keys.whole("evaluation.instances", given.get("instances", 20), least=1, most=_MOST_INSTANCES)
        return cls(
            every=keys.whole("evaluation.every", given["every"], least=1, most=_MOST_STEPS),
            instances=instances,
            seed=keys.whole(
                "evaluation.seed",
                given.get("seed", HELD_OUT_FROM),
                least=HELD_OUT_FROM,
                most=LARGEST_SEED - instances,
            ),
            agents=_agents(given.get("agents", [RANDOM, "snake"])),
            deterministic=bool(keys.fitting("evaluation.deterministic", given.get("deterministic", True), bool)),
        )


@dataclass(frozen=True, kw_only=True)
class TrainingConfig:
    """A checked training configuration.

    Attributes:
        name: What messages and result files call it.
        algorithm: `ppo`, `sac` or `maskable-ppo`.
        scenario: The scenario with every key resolved.
        total_steps: Environment steps, all environments together.
        num_envs: Number of environments that step together.
        num_threads: Number of threads that step them; it changes no result.
        seed: Environment i begins with seed + i, all below the held-out seeds.
        checkpoint_every: Steps between two checkpoints.
        weed_counts: Numbers of weeds to learn from, each in an equal share of the environments; the scenario's own is
            the one that is evaluated. Empty: the scenario's own alone.
        policy: `class` and the policy's keyword arguments, as written.
        hyperparameters: Keyword arguments of the algorithm, as written.
        normalize: Keyword arguments of VecNormalize, as written; None: nothing is normalised.
        evaluation: How the policy is evaluated while it learns; None: it is not.
    """

    name: str
    algorithm: str
    scenario: Scenario
    total_steps: int
    num_envs: int
    num_threads: int
    seed: int
    checkpoint_every: int
    weed_counts: tuple[int, ...]
    policy: Mapping[str, object]
    hyperparameters: Mapping[str, object]
    normalize: Mapping[str, object] | None
    evaluation: Evaluation | None

    @classmethod
    def read(cls, source: str | os.PathLike[str], *, seed: int | None = None) -> TrainingConfig:
        """Reads a file, or a shipped configuration by its name (`ppo-features`).

        Args:
            source: The file or the name.
            seed: Takes the place of the file's seed; None: the file's own.

        Raises:
            ConfigError: If there is neither, or for the first key that cannot be used.
        """
        shipped = dict(_native.shipped_trainings())
        name = os.fspath(source)
        instead = {} if seed is None else {"seed": seed}
        if name in shipped:
            return cls.check(_native.parse_toml(shipped[name], name) | instead, name=name)
        path = Path(source)
        try:
            text = path.read_text(encoding="utf-8")
        except FileNotFoundError:
            hint = keys.did_you_mean(name, shipped)
            text = f"cannot read {name}: no such file, and no shipped training ({', '.join(shipped)}){hint}"
            raise ConfigError(text) from None
        except (OSError, UnicodeDecodeError) as error:
            text = f"cannot read {name}: {error}"
            raise ConfigError(text) from error
        given = _native.parse_toml(text, path.name)
        try:
            config = cls.check(given, name=path.stem, folder=path.parent)
        except ConfigError as error:
            text = f"{name}: {error}"
            raise ConfigError(text) from error
        # What is wrong with another seed is not the file's fault.
        return cls.check(given | instead, name=path.stem, folder=path.parent) if instead else config

    @classmethod
    def check(
        cls, given: Mapping[str, object], *, name: str = "training", folder: Path | None = None
    ) -> TrainingConfig:
        """Checks every key.

        Args:
            given: The file as a dictionary.
            name: What messages and result files call it.
            folder: Where `scenario.base` is looked for, if it is a file; None: where Python runs.

        Raises:
            ConfigError: For the first key that cannot be used.
        """
        keys.refuse_unknown("", given, (*_KEYS, *_BLOCKS))
        for needed in ("algorithm", "total_steps"):
            if needed not in given:
                text = f"`{needed}` must be given"
                raise ConfigError(text)
        algorithm = keys.choice("algorithm", given["algorithm"], ALGORITHMS)
        total_steps = keys.whole("total_steps", given["total_steps"], least=1, most=_MOST_STEPS)
        num_envs = keys.whole("num_envs", given.get("num_envs", 16), least=1, most=_MOST_ENVS)
        scenario = _scenario(given.get("scenario", {}), folder or Path())
        config = cls(
            name=name,
            algorithm=algorithm,
            scenario=scenario,
            total_steps=total_steps,
            num_envs=num_envs,
            num_threads=keys.whole("num_threads", given.get("num_threads", 1), least=1, most=MOST_THREADS),
            # The seeds of all environments stay below the held-out ones.
            seed=keys.whole("seed", given.get("seed", 0), least=0, most=HELD_OUT_FROM - num_envs),
            checkpoint_every=keys.whole(
                "checkpoint_every", given.get("checkpoint_every", max(total_steps // 10, 1)), least=1, most=_MOST_STEPS
            ),
            weed_counts=_weed_counts(given.get("weed_counts", []), num_envs),
            policy={
                "class": "MultiInputPolicy" if kind_of(scenario, "observation") == "dict" else "MlpPolicy",
                **keys.block("policy", given.get("policy", {})),
            },
            hyperparameters=keys.block("hyperparameters", given.get("hyperparameters", {})),
            normalize=keys.block("normalize", given["normalize"]) if "normalize" in given else None,
            evaluation=(
                Evaluation.check(keys.block("evaluation", given["evaluation"])) if "evaluation" in given else None
            ),
        )
        if config.action_kind not in ALGORITHMS[algorithm]:
            kinds = " or ".join(f"`{kind}`" for kind in ALGORITHMS[algorithm])
            text = f"`scenario.action.kind` must be {kinds} for `{algorithm}`, got `{config.action_kind}`"
            raise ConfigError(text)
        if config.evaluation is not None:
            refuse_endless("scenario.episode.budget", scenario)
        return config

    @property
    def action_kind(self) -> str:
        """The scenario's `action.kind`."""
        return kind_of(self.scenario, "action")

    @property
    def observation_kind(self) -> str:
        """The scenario's `observation.kind`."""
        return kind_of(self.scenario, "observation")

    def to_dict(self) -> dict[str, object]:
        """Returns every key with its value, as a file could hold it: what tells this training from others."""
        evaluation = self.evaluation
        return {
            "algorithm": self.algorithm,
            "total_steps": self.total_steps,
            "num_envs": self.num_envs,
            "num_threads": self.num_threads,
            "seed": self.seed,
            "checkpoint_every": self.checkpoint_every,
            **({"weed_counts": list(self.weed_counts)} if self.weed_counts else {}),
            "policy": dict(self.policy),
            "hyperparameters": dict(self.hyperparameters),
            **({} if self.normalize is None else {"normalize": dict(self.normalize)}),
            **({} if evaluation is None else {"evaluation": {**vars(evaluation), "agents": list(evaluation.agents)}}),
            "scenario": self.scenario.to_dict(),
        }


def kind_of(scenario: Scenario, name: str) -> str:
    """Returns the `kind` of a scenario's block."""
    return str(keys.block(name, scenario.to_dict()[name])["kind"])


def refuse_endless(field: str, scenario: Scenario) -> None:
    """Refuses a scenario whose episodes need not end: nothing but its budget stops a policy that drives in circles.

    Args:
        field: What the caller calls the budget.
        scenario: Whose episodes are to be played.

    Raises:
        ConfigError: If the budget is infinite.
    """
    budget = keys.block("episode", scenario.to_dict()["episode"])["budget"]
    if budget == math.inf:
        text = f"`{field}` must be finite, for nothing else ends the episode of a policy that circles; got inf"
        raise ConfigError(text)


def _scenario(given: object, folder: Path) -> Scenario:
    if isinstance(given, str):
        given = {"base": given}
    blocks = keys.block("scenario", given)
    base = keys.text("scenario.base", blocks.pop("base")) if "base" in blocks else None
    # The id is a key of the file, not a block: it can only be the one there is.
    source: object = {"id": blocks.pop("id")} if base is None and "id" in blocks else base
    if base is not None and base not in _native.shipped():
        source = folder / base
    return _native.Scenario(source, **blocks)  # type: ignore[arg-type] # checked there


def _weed_counts(given: object, num_envs: int) -> tuple[int, ...]:
    if not isinstance(given, list) or (given and num_envs % len(given)):
        text = f"`weed_counts` must be a list whose length divides `num_envs`, {num_envs}, got {given}"
        raise ConfigError(text)
    return tuple(keys.whole("weed_counts", count, least=0, most=_MOST_WEEDS) for count in given)


def _agents(given: object) -> tuple[str, ...]:
    if not isinstance(given, list) or not all(isinstance(agent, str) for agent in given):
        text = f"`evaluation.agents` must be a list of agents, got {given}"
        raise ConfigError(text)
    labels = [agent if agent == RANDOM else _native.AgentSpec(agent).label for agent in given]
    for number, label in enumerate(labels):
        if label in labels[:number]:
            text = f"`evaluation.agents` must differ in their names, got `{label}` twice"
            raise ConfigError(text)
    return tuple(labels)
