"""Many environments as one: Gymnasium's vector environment over the native batch."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, SupportsIndex

import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from swath import _native
from swath.errors import ClosedError, ConfigError
from swath.options import bytes_of, mask_of, weeds_of
from swath.rendering import RENDER_FPS, RENDER_SIZE, check_render_mode
from swath.seeds import drawn_seed
from swath.spaces import action_space, observation_space

if TYPE_CHECKING:
    from typing import TypeAlias

    from typing_extensions import Unpack

    from swath.remote.batch import RemoteBatch
    from swath.scenario import Blocks, Scenario, ScenarioSource

__all__ = [
    "MOST_ENVS",
    "MOST_THREADS",
    "MowerRoutingVectorEnv",
    "Observations",
    "autoreset_from",
    "checked_count",
]

Observations: TypeAlias = "npt.NDArray[np.generic] | dict[str, npt.NDArray[np.generic]]"
"""One array with a row an environment, or a dictionary of such arrays where an observation has several parts."""

Flags: TypeAlias = "npt.NDArray[np.bool_]"
Infos: TypeAlias = "dict[str, object]"

MOST_ENVS = 1_000_000
"""Largest number of environments that may be asked for."""

MOST_THREADS = 1024
"""Largest number of threads that may be asked for."""


class MowerRoutingVectorEnv(VectorEnv["Observations", "npt.ArrayLike", "npt.NDArray[np.generic]"]):
    """Many pastures with one mower each, stepped in one native call; `gym.make_vec` makes it.

    Every environment is a `MowerRoutingEnv`, which describes actions, observations, rewards and infos. Environment i of
    a vector seeded s is the environment seeded s + i, for any number of environments and threads; each goes on with the
    later episodes of its own seed.

    | `autoreset_mode` | the step that ends an episode returns | the step after |
    |---|---|---|
    | `NEXT_STEP` (default) | its last observation | ignores its action: first observation of a new episode, reward 0 |
    | `SAME_STEP` | the first observation of the next episode; the last one in `infos["final_obs"]` | an ordinary step |
    | `DISABLED` | its last observation | an error until `reset(options={"reset_mask": ...})` |

    Infos have an array for each key, and under the key with an underscore in front the rows that have it.
    The keys of `swath.Summary` are there at steps that end an episode; with `SAME_STEP` inside `infos["final_info"]`.

    ## Arguments

    - `num_envs`: from 1 to 1,000,000.
    - `scenario` and its blocks, `render_size`: as those of `MowerRoutingEnv`.
    - `render_mode`: None, or `rgb_array`: `render` returns a picture of every environment.
    - `autoreset_mode`: a member of `gymnasium.vector.AutoresetMode` or its value (`NextStep`, `SameStep`, `Disabled`).
    - `num_threads`: most threads that a step may use (default 1: the caller's own), from 1 to 1024; more than the
      system can start are refused. Results never depend on it. Fewer than 64 environments are not worth a thread (than
      4 where observations hold maps), so that few are never shared.
    - `copy`: whether every step returns fresh arrays (default). With False the observations of all steps are the same
      arrays, each step overwriting the one before; rewards, flags and infos are always fresh.

    ```python
    envs = gym.make_vec("swath/MowerRouting-v0", num_envs=1024, weeds={"count": 160})
    ```
    """

    def __init__(
        self,
        num_envs: int = 1,
        scenario: ScenarioSource = None,
        *,
        render_mode: str | None = None,
        render_size: tuple[int, int] = RENDER_SIZE,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        num_threads: int = 1,
        copy: bool = True,
        **blocks: Unpack[Blocks],
    ) -> None:
        """Makes environments that wait for their first reset.

        Args:
            num_envs: How many.
            scenario: A shipped name, a file, a dictionary, a `Scenario`, or None for the defaults.
            render_mode: None or `rgb_array`.
            render_size: Width and height of a picture, pixels.
            autoreset_mode: When an environment whose episode ended begins the next one.
            num_threads: Most threads that a step may use.
            copy: Whether every step returns fresh observations.
            **blocks: Blocks of the scenario, laid over it key by key.

        Raises:
            ConfigError: If the scenario or an argument cannot be used; the message names it.
        """
        check_render_mode(render_mode, ("rgb_array",))
        mode = autoreset_from(autoreset_mode)
        num_envs = checked_count("num_envs", num_envs, MOST_ENVS)
        threads = checked_count("num_threads", num_threads, MOST_THREADS)
        core = _native.Scenario(scenario, **blocks)
        size = None if render_mode is None else render_size
        batch = _native.Batch(core, num_envs, mode.value, threads, copy=bool(copy), picture_size=size)
        self._adopt(batch, num_envs, mode)
        self.render_mode = render_mode
        self.metadata |= {"render_modes": ["rgb_array"], "render_fps": RENDER_FPS}

    def _adopt(self, batch: _native.Batch | RemoteBatch, num_envs: int, mode: AutoresetMode) -> None:
        """Becomes the face of a batch."""
        self._batch = batch
        self.num_envs = num_envs
        self.metadata = {"render_modes": [], "autoreset_mode": mode}
        self.render_mode = None
        self.single_observation_space = observation_space(self._batch.observation_spec)
        self.single_action_space = action_space(self._batch.action_spec)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    @property
    def scenario(self) -> Scenario:
        """The scenario with every key resolved."""
        return self._core.scenario

    @property
    def observation_names(self) -> list[str]:
        """Name of every number of an observation, in order."""
        return [name for _, _, _, bounds in self._core.observation_spec for name, _, _ in bounds]

    @property
    def _core(self) -> _native.Batch | RemoteBatch:
        if self.closed:
            text = "`reset` and `step` must come before `close`"
            raise ClosedError(text)
        return self._batch

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Mapping[str, object] | None = None,
    ) -> tuple[Observations, Infos]:
        """Begins an episode in every environment, or in some.

        Args:
            seed: Environment i begins episode 0 of the seed `seed` + i, or of `seed[i]`; where that is None, the next
                episode of its present seed.
            options: Never modified. `weeds`: an array (n, 2) that places the weeds of every environment, world frame,
                metres; or a list of one such array or None for each. `reset_mask`: (num_envs,) bool, which environments
                begin anew; the others stay as they are.

        Returns:
            observations: The present ones of all environments.
            infos: The keys of a step, with zeros, of the environments that began.

        Raises:
            ConfigError: If the seed or an option cannot be used; nothing has changed then.
            ClosedError: After `close`.
        """
        batch = self._core
        weeds = weeds_of(options, self.num_envs, others=("reset_mask",))
        mask = mask_of(options, self.num_envs)
        base, seeds = _seeds(seed, self.num_envs)
        first_seed = None
        if not batch.has_begun and None in seeds:
            first_seed = drawn_seed(self.np_random)
        result = batch.reset(seeds, mask, weeds, first_seed)
        if base is not None:
            super().reset(seed=base)
        return result

    def step(self, actions: npt.ArrayLike) -> tuple[Observations, npt.NDArray[np.float64], Flags, Flags, Infos]:
        """Steps every environment.

        Args:
            actions: One row an environment, (num_envs, action_size) float32, or (num_envs,) choices.

        Returns:
            observations: One row an environment.
            rewards: (num_envs,) float64.
            terminations: (num_envs,) bool.
            truncations: (num_envs,) bool.
            infos: See the class.

        Raises:
            ActionError: If the actions have another shape or one of them cannot be carried out (the message names its
                row), before the first reset, and with `DISABLED` after the end of an episode; nothing has moved then.
            ClosedError: After `close`.
        """
        return self._core.step(actions)

    def render(self) -> tuple[npt.NDArray[np.uint8], ...] | None:
        """Returns a picture of every environment as it stands.

        What a picture keeps for the next one takes about 3 MB an environment at 640 x 360.

        Returns:
            pictures: (height, width, 3) uint8 each, fresh arrays; None without a render mode.

        Raises:
            ActionError: Before the first reset.
            ClosedError: After `close`.
        """
        batch = self._core
        if self.render_mode is None or not isinstance(batch, _native.Batch):
            return None
        return tuple(batch.render())

    def close_extras(self, **kwargs: object) -> None:
        """Frees the environments."""
        self.__dict__.pop("_batch", None)

    def snapshot(self, row: int | None = None) -> bytes:
        """Returns the state as bytes: all but the scenario and `np_random`.

        Args:
            row: One environment, whose snapshot a `MowerRoutingEnv` can restore too. None: all of them.
        """
        return self._core.snapshot(_row(row, self.num_envs))

    def restore(self, snapshot: bytes, row: int | None = None) -> None:
        """Puts back what `snapshot` returned, here or in another vector of the same scenario.

        Args:
            snapshot: The bytes.
            row: The one environment to put it into. None: all of them.

        Raises:
            SnapshotError: If they are damaged, or of another version, scenario or number of environments; nothing has
                changed then.
        """
        self._core.restore(bytes_of(snapshot), _row(row, self.num_envs))


def checked_count(field: str, count: SupportsIndex, most: int) -> int:
    """Returns `count` if it is a whole number from 1 to `most`.

    Raises:
        ConfigError: If not; the message names `field`.
    """
    try:
        number = operator.index(count)
    except TypeError:
        number = 0
    if isinstance(count, bool) or not 1 <= number <= most:
        text = f"`{field}` must be a whole number from 1 to {most}, got {count!r}"
        raise ConfigError(text)
    return number


def autoreset_from(mode: AutoresetMode | str) -> AutoresetMode:
    """Returns the mode of that name.

    Raises:
        ConfigError: If there is none.
    """
    try:
        return AutoresetMode(mode)
    except ValueError:
        values = ", ".join(f"`{member.value}`" for member in AutoresetMode)
        text = f"`autoreset_mode` must be an AutoresetMode or one of {values}, got {mode!r}"
        raise ConfigError(text) from None


def _seeds(seed: int | Sequence[int | None] | None, num_envs: int) -> tuple[int | None, list[int | None]]:
    """Returns the one seed that was given, if it was one, and the seed of each environment."""
    if seed is None:
        return None, [None] * num_envs
    try:
        base = operator.index(seed)  # type: ignore[arg-type] # what is no number raises
    except TypeError:
        pass
    else:
        return base, [base + row for row in range(num_envs)]
    if isinstance(seed, Sequence | np.ndarray) and not isinstance(seed, str):
        return None, list(seed)
    text = f"`seed` must be a whole number, a list of {num_envs} of them, or None, got {seed!r}"
    raise ConfigError(text)


def _row(row: int | None, num_envs: int) -> int | None:
    if row is None:
        return None
    number = operator.index(row)
    if not 0 <= number < num_envs:
        text = f"`row` must be from 0 to {num_envs - 1}, got {row}"
        raise ConfigError(text)
    return number
