"""What happens beside the learning: evaluation, checkpoints and a bar."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from stable_baselines3.common.callbacks import BaseCallback

if TYPE_CHECKING:
    from swath.progress import Progress

__all__ = ["Beside"]


class Beside(BaseCallback):
    """Evaluates and saves where a rollout begins: only there is the state of a training complete."""

    def __init__(
        self,
        *,
        evaluate: Callable[[int], None],
        evaluate_every: int | None,
        save: Callable[[], None],
        save_every: int,
        bar: Progress,
    ) -> None:
        """Prepares.

        Args:
            evaluate: Evaluates the policy, called with the number of steps.
            evaluate_every: Steps between two evaluations; None: never.
            save: Writes a checkpoint.
            save_every: Steps between two checkpoints.
            bar: Counts the steps.
        """
        super().__init__()
        self._evaluate, self._save, self._bar = evaluate, save, bar
        self._evaluate_every, self._save_every = evaluate_every, save_every
        self._evaluated = -1
        self._saved = 0

    def _on_training_start(self) -> None:
        # A training that goes on was evaluated and saved at this step.
        self._saved = self.num_timesteps
        self._evaluated = self.num_timesteps if self.num_timesteps else -1

    def _on_rollout_start(self) -> None:
        # SB3 counts in `num_timesteps` of the callback only with the next step.
        steps = self.model.num_timesteps
        if self._evaluate_every is not None and _is_due(steps, self._evaluated, self._evaluate_every):
            self._evaluate(steps)
            self._evaluated = steps
        if _is_due(steps, self._saved, self._save_every):
            self._save()
            self._saved = steps

    def _on_step(self) -> bool:
        self._bar.advance(self.training_env.num_envs)
        return True


def _is_due(steps: int, last: int, every: int) -> bool:
    """Whether a multiple of `every` was reached since `last`."""
    return steps // every > last // every
