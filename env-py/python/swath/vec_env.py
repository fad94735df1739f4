"""The `VecEnv` of stable-baselines3 over the native batch; `swath.sb3.make_vec_env` makes it."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv

from swath import _native
from swath.errors import ActionError, ClosedError, ConfigError
from swath.evaluation.study import whole
from swath.options import bytes_of, weeds_of
from swath.remote.batch import RemoteBatch
from swath.rendering import RENDER_FPS
from swath.seeds import LARGEST_SEED, drawn_seed
from swath.spaces import action_space, observation_space

if TYPE_CHECKING:
    from typing import Any, TypeAlias

    from gymnasium.envs.registration import EnvSpec

    from swath.scenario import Scenario
    from swath.vector import Flags, Observations

__all__ = ["MowerRoutingVecEnv", "RowEnv"]

Info: TypeAlias = "dict[str, object]"
Indices: TypeAlias = "int | Iterable[int] | None"
Options: TypeAlias = "Mapping[str, object] | Sequence[Mapping[str, object]] | None"
Space: TypeAlias = "gym.Space[Any]"


class RowEnv:
    """One environment of the batch, as `get_attr`, `set_attr` and `env_method` know it.

    Attributes:
        spec: What Gymnasium has registered, with the keywords that the environments were made with.
        observation_space: Of one environment.
        action_space: Of one environment.
        render_mode: None or `rgb_array`.
    """

    metadata: dict[str, object] = {"render_modes": ["rgb_array"], "render_fps": RENDER_FPS}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(
        self,
        batch: _native.Batch | RemoteBatch,
        row: int,
        spec: EnvSpec,
        spaces: tuple[Space, Space],
        render_mode: str | None,
    ) -> None:
        """Names the environment in the row `row` of `batch`."""
        self._batch, self._row = batch, row
        self.render_mode = render_mode
        self.spec = spec
        self.observation_space, self.action_space = spaces

    @property
    def unwrapped(self) -> RowEnv:
        """Itself."""
        return self

    @property
    def scenario(self) -> Scenario:
        """The scenario with every key resolved."""
        return self._batch.scenario

    @property
    def observation_names(self) -> list[str]:
        """Name of every number of an observation, in order."""
        return [name for _, _, _, bounds in self._batch.observation_spec for name, _, _ in bounds]

    def snapshot(self) -> bytes:
        """Returns the state of the episode as bytes; a `MowerRoutingEnv` can restore it too."""
        return self._batch.snapshot(self._row)

    def restore(self, snapshot: bytes) -> None:
        """Puts back what `snapshot` returned; the statistics of the episode begin anew."""
        self._batch.restore(bytes_of(snapshot), self._row)

    def has_wrapper_attr(self, name: str) -> bool:
        """Tells whether there is an attribute, as on any environment of Gymnasium."""
        return hasattr(self, name)

    def get_wrapper_attr(self, name: str) -> object:
        """Returns an attribute, as on any environment of Gymnasium."""
        return getattr(self, name)

    def set_wrapper_attr(self, name: str, value: object) -> bool:
        """Sets an attribute, as on any environment of Gymnasium."""
        setattr(self, name, value)
        return True


class MowerRoutingVecEnv(VecEnv):  # type: ignore[misc] # stable-baselines3 is read as untyped
    """Many pastures with one mower each, stepped in one native call.

    An environment seeded s goes through the same episodes as a `MowerRoutingEnv` seeded s in a `DummyVecEnv`; one that
    ended is followed by the next in the same step.

    Every info holds `TimeLimit.truncated`. The last info of an episode also holds `terminal_observation`, `episode` as
    `Monitor` gives it (`r`: sum of rewards, `l`: steps, `t`: seconds since the start), so that no monitor is needed,
    `reward_terms`, `action_clipped` and the keys of `swath.Summary`, with the action kind `target` also `elapsed_m` and
    `action_mask`; masked learners ask for the masks by `env_method("action_masks")`. Whatever a step returns is fresh.
    """

    def __init__(
        self, batch: _native.Batch | RemoteBatch, num_envs: int, spec: EnvSpec, render_mode: str | None = None
    ) -> None:
        """Wraps a batch that begins anew in the step that ends an episode."""
        self._batch = batch
        self._is_closed = False
        self._has_decisions = batch.scenario.to_dict()["action"]["kind"] == "target"  # type: ignore[index]
        spaces = (observation_space(batch.observation_spec), action_space(batch.action_spec))
        self._envs = [RowEnv(batch, row, spec, spaces, render_mode) for row in range(num_envs)]
        self._actions: npt.ArrayLike | None = None
        self._start_s = time.time()
        super().__init__(num_envs, *spaces)
        self.metadata["render_fps"] = RENDER_FPS

    @property
    def spec(self) -> EnvSpec:
        """What Gymnasium has registered, with the keywords that the environments were made with."""
        return self._envs[0].spec

    @property
    def _core(self) -> _native.Batch | RemoteBatch:
        if self._is_closed:
            text = "`reset` and `step` must come before `close`"
            raise ClosedError(text)
        return self._batch

    def seed(self, seed: int | None = None) -> Sequence[int]:
        """Keeps a seed for the next reset.

        Args:
            seed: Environment i begins episode 0 of the seed `seed` + i. None: seeds are drawn.

        Returns:
            The seed of every environment.

        Raises:
            ConfigError: If the seed cannot be used; what was kept before stays.
        """
        if seed is not None:
            seed = whole("seed", seed, least=0, most=LARGEST_SEED - (self.num_envs - 1))
        seeds: Sequence[int] = super().seed(seed)
        return seeds

    def set_options(self, options: Options = None) -> None:
        """Keeps options for the next reset, and for no later one.

        Args:
            options: Those of `MowerRoutingEnv.reset` for every environment, or a list of such dictionaries, one for
                each. Never modified.

        Raises:
            ConfigError: If there is another number of them, or one holds more than `weeds`; what was kept before stays.
        """
        rows = [options or {}] * self.num_envs if options is None or isinstance(options, Mapping) else options
        for row in rows if isinstance(rows, list | tuple) else [rows]:
            if not isinstance(row, Mapping):
                text = f"`options` must be a dictionary or a list of them, got `{type(row).__name__}`"
                raise ConfigError(text)
            weeds_of(row, 1)
        if len(rows) != self.num_envs:
            text = f"`options` must be one for each of {self.num_envs} environments, got {len(rows)}"
            raise ConfigError(text)
        super().set_options([dict(row) for row in rows])

    def reset(self) -> Observations:
        """Begins an episode in every environment, with the seeds and options set since the last reset.

        Returns:
            One row an environment.

        Raises:
            ConfigError: If weeds cannot be placed; nothing has changed then, but that the options are gone.
            ClosedError: After `close`.
        """
        batch, seeds = self._core, list(self._seeds)
        weeds = [next(iter(weeds_of(options, 1)), None) for options in self._options]
        self._reset_options()
        first_seed = None
        if not batch.has_begun and None in seeds:
            first_seed = drawn_seed(np.random.default_rng())
        observations: Observations = batch.reset(seeds, None, weeds, first_seed)[0]
        self._write_reset_infos(range(self.num_envs))
        self._reset_seeds()
        return observations

    def step_async(self, actions: npt.ArrayLike) -> None:
        """Keeps the actions, one row an environment, for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[Observations, npt.NDArray[np.float32], Flags, list[Info]]:
        """Steps every environment.

        Returns:
            observations: One row an environment; of an episode that ended, the first one of the next.
            rewards: (num_envs,) float32.
            dones: (num_envs,) bool.
            infos: See the class.

        Raises:
            ActionError: If the actions have another shape or one of them cannot be carried out (the message names its
                row), before the first reset, and without a `step_async` before; nothing has moved then.
            ClosedError: After `close`.
        """
        actions, self._actions = self._actions, None
        if actions is None:
            text = "`step_wait` must follow `step_async`, which has the actions"
            raise ActionError(text)
        elapsed_s = time.time() - self._start_s
        observations, rewards, dones, infos, ended = self._core.step_flat(actions, elapsed_s)
        if ended:
            self._write_reset_infos(ended)
        return observations, rewards, dones, infos

    def _write_reset_infos(self, rows: Iterable[int]) -> None:
        masks = self._core.action_masks if self._has_decisions else None
        for row in rows:
            self.reset_infos[row] = _reset_info()
            if masks is not None:
                self.reset_infos[row] |= {"elapsed_m": 0.0, "action_mask": masks[row].copy()}

    def close(self) -> None:
        """Ends the use of the environments; closing twice is fine."""
        if isinstance(self._batch, RemoteBatch):
            self._batch.close()
        self._is_closed = True

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[object]:
        """Returns an attribute of every environment, see `RowEnv`.

        Raises:
            AttributeError: If there is none.
        """
        if attr_name == "action_masks":
            self._masks()
            return [partial(self._mask, row) for row in self._get_indices(indices)]
        return [getattr(self._envs[row], attr_name) for row in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: object, indices: Indices = None) -> None:
        """Sets an attribute of every environment."""
        for row in self._get_indices(indices):
            setattr(self._envs[row], attr_name, value)

    def env_method(self, method_name: str, *args: object, indices: Indices = None, **kwargs: object) -> list[object]:
        """Calls a method of every environment; `action_masks` where the action kind has masks.

        Raises:
            AttributeError: If there is none.
        """
        if method_name == "action_masks":
            masks = self._masks()
            return [masks[row] for row in self._get_indices(indices)]
        return [getattr(self._envs[row], method_name)(*args, **kwargs) for row in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type[object], indices: Indices = None) -> list[bool]:
        """Says yes to `Monitor`, whose work is done natively, and no to every other wrapper."""
        return [wrapper_class is Monitor for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[npt.NDArray[np.uint8] | None]:
        """Returns a picture of every environment as it stands, which `render` puts together.

        Returns:
            pictures: (height, width, 3) uint8 each, fresh arrays; None each without a render mode.
        """
        if self.render_mode is None or not isinstance(self._core, _native.Batch):
            warnings.warn(f"the render mode is {self.render_mode}: there are no images", stacklevel=2)
            return [None] * self.num_envs
        return self._core.render()

    def _masks(self) -> Flags:
        """Returns which choices every environment has; the batch has the attribute where its action kind has masks."""
        masks: Flags = getattr(self._core, "action_masks")  # noqa: B009 - the attribute may be missing
        return masks

    def _mask(self, row: int) -> Flags:
        mask: Flags = self._masks()[row]
        return mask


def _reset_info() -> Info:
    return {"reward_terms": {"weed": 0.0, "path": 0.0, "failure": 0.0}, "action_clipped": False}
