"""The training itself."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from swath import evaluation
from swath.progress import Progress
from swath.training.algorithms import check_parameters, new_model
from swath.training.card import write_model
from swath.training.checkpoint import Checkpoints
from swath.training.config import RANDOM, Evaluation, TrainingConfig
from swath.training.curve import POLICY, Curve, line_of
from swath.training.environments import make_bare_venv, make_training_venv
from swath.training.folder import Folder
from swath.training.generators import unchanged
from swath.training.play import evaluate_policy
from swath.training.policy import Policy, RandomPlayer
from swath.training.times import Times

if TYPE_CHECKING:
    from swath.evaluation.row import Row
    from swath.training.policy import Player

__all__ = ["train"]


def train(
    config: TrainingConfig | str | os.PathLike[str],
    *,
    out: str | os.PathLike[str],
    progress: bool = False,
    say: Callable[[str], None] = lambda line: None,
) -> Curve:
    """Trains a policy with stable-baselines3, or goes on with a training that was stopped.

    The folder gets `training.toml` (every key written out), `tensorboard/`, `checkpoints/`, `evaluations.csv` (one row
    for each episode played for evaluation), `times.csv`, `untrained.zip`, and `model.zip` when the training is over;
    beside each model a `.toml` file says what it is, and `load_policy` reads it.
    A training that was killed goes on from its last checkpoint, and ends as if it had not been killed: the same
    parameters, the same evaluations (but for gSDE, whose noise is drawn anew).

    Args:
        config: A file, a shipped name such as `ppo-features`, or a checked configuration.
        out: The folder.
        progress: Whether a bar on stderr tells how far it is.
        say: Gets one line about every evaluation.

    Returns:
        How the policy did while it learned, beside the agents that do not learn.

    Raises:
        ConfigError: If the configuration cannot be used, or the folder holds another training, or one that other
            versions of swath or of the packages have begun; nothing has been written then.
        SnapshotError: If the last checkpoint is damaged; nothing has been written then.
        ModuleNotFoundError: If a package is missing; the message names the extra.
    """
    config = config if isinstance(config, TrainingConfig) else TrainingConfig.read(config)
    check_parameters(config)
    folder = Folder(Path(out), config)
    if folder.model.with_suffix(".toml").exists():
        say(f"{folder.path} holds this training, finished")
        return Curve.read(folder.evaluations)
    with folder:
        # Whatever can be refused is made before anything is written.
        training = _Training(config, folder, say)
        folder.begin()
        with Progress("steps", config.total_steps, is_wanted=progress) as bar:
            training.learn(bar)
        return training.curve


class _Training:
    """One training between two starts of the process."""

    def __init__(self, config: TrainingConfig, folder: Folder, say: Callable[[str], None]) -> None:
        """Begins, or goes on from the last checkpoint."""
        self.config, self.folder, self.say = config, folder, say
        self.checkpoints = Checkpoints(folder.checkpoints, config)
        self.curve = Curve.read(folder.evaluations)
        newest = self.checkpoints.newest()
        if newest is None:
            self.model, before_s = new_model(config, make_training_venv(config)), 0.0
            self.checkpoints.check_room(self.model)
        else:
            venv = make_bare_venv(config)
            self.model, before_s = self.checkpoints.load(newest, venv)
        self.steps_before = self.model.num_timesteps
        self.curve.forget_after(self.steps_before if newest is not None else -1)
        self.times = Times(folder.times, self.steps_before, before_s)

    def learn(self, bar: Progress) -> None:
        """Learns up to the last step, and writes the model."""
        from stable_baselines3.common.logger import configure

        from swath.training.callback import Beside

        config, model = self.config, self.model
        bar.resume(self.steps_before)
        if self.steps_before:
            self.say(f"goes on from step {self.steps_before}")
        model.set_logger(configure(str(self.folder.path / "tensorboard"), ["tensorboard"]))
        beside = Beside(
            evaluate=lambda steps: self.evaluate(steps, bar),
            evaluate_every=None if config.evaluation is None else config.evaluation.every,
            save=lambda: self.checkpoints.write(model, self.times.wall_s),
            save_every=config.checkpoint_every,
            bar=bar,
        )
        if self.steps_before < config.total_steps:
            if not self.steps_before:
                write_model(self.folder.untrained, model, config)
            model.learn(
                config.total_steps - self.steps_before, callback=beside, reset_num_timesteps=not self.steps_before
            )
        if config.evaluation is not None and model.num_timesteps not in self.curve.steps:
            self.evaluate(model.num_timesteps, bar)
        write_model(self.folder.model, model, config)
        model.logger.close()

    def evaluate(self, steps: int, bar: Progress) -> None:
        """Plays the evaluation's instances, and writes all rows so far."""
        plan = self.config.evaluation
        assert plan is not None, "it is called where there is an evaluation"
        if not self.curve.agents:
            self._evaluate_others(plan)
        policy = Policy(self.model, self.model.get_vec_normalize_env(), plan.deterministic)
        self.curve.add(steps, POLICY, self._play(policy, plan, POLICY))
        self.curve.write(self.folder.evaluations)
        self.times.write(steps)
        self._log(steps, plan)
        self.say("; ".join(part for part in (line_of(self.curve, steps), bar.left()) if part))

    def _evaluate_others(self, plan: Evaluation) -> None:
        scripted = [agent for agent in plan.agents if agent != RANDOM]
        if RANDOM in plan.agents:
            player = RandomPlayer(self.model.action_space)
            self.curve.add(0, RANDOM, self._play(player, plan, RANDOM))
        if scripted:
            results = evaluation.evaluate(
                scripted,
                scenario=self.config.scenario,
                instances=plan.instances,
                seed=plan.seed,
                jobs=self.config.num_threads,
            )
            for agent in scripted:
                self.curve.add(0, agent, results.of_cell(0, agent))

    def _play(self, player: Player, plan: Evaluation, label: str) -> Sequence[Row]:
        with unchanged():
            return evaluate_policy(
                player,
                scenario=self.config.scenario,
                instances=plan.instances,
                seed=plan.seed,
                label=label,
                num_threads=self.config.num_threads,
            )

    def _log(self, steps: int, plan: Evaluation) -> None:
        log = self.model.logger
        log.record("evaluation/path_m", self.curve.path_m(POLICY, steps)["mean"])
        log.record("evaluation/weeds_mowed", self.curve.weeds_mowed(POLICY, steps)["mean"])
        for agent in plan.agents:
            log.record(f"evaluation/path_minus_{agent}_m", self.curve.longer_m(steps, agent)["mean"])
        log.dump(steps)
