"""The Gymnasium environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from swath import _native
from swath.errors import ClosedError
from swath.options import bytes_of, weeds_of_one
from swath.rendering import RENDER_FPS, RENDER_SIZE, Screen, check_render_mode
from swath.seeds import drawn_seed
from swath.spaces import action_space, observation_space

if TYPE_CHECKING:
    from typing import TypeAlias

    from typing_extensions import Unpack

    from swath.scenario import Blocks, Scenario, ScenarioSource

__all__ = ["MowerRoutingEnv"]

Array: TypeAlias = "npt.NDArray[np.float32] | npt.NDArray[np.int8] | npt.NDArray[np.uint8]"
Observation: TypeAlias = "Array | dict[str, Array]"
Action: TypeAlias = "npt.NDArray[np.float32] | np.int64"
Info: TypeAlias = "dict[str, object]"


class MowerRoutingEnv(gym.Env[Observation, Action]):
    """Find and mow every weed of a pasture whose weeds are unknown, on a path as short as possible.

    ## Description

    A mower that cannot turn tighter than a radius R drives over a rectangular pasture, with x along its length, y along
    its width and the origin at the lower left corner; lengths are metres, angles radians counter-clockwise from +x.
    It detects weeds inside a triangle in front of it, whose apex is the middle of its bar, and mows whatever the bar of
    width B passes over, detected or not. It may leave the pasture to turn, as far as the headland.
    The sensor looks at path 0, 0.2, 0.4 ... m, however the path is cut into steps.

    ## Action Space

    | `action.kind` | space | meaning |
    |---|---|---|
    | `steer` (default) | `Box(-1, 1, (1,), float32)` | curvature as a fraction of 1/R, left positive |
    | `drive` | `Box(-1, 1, (2,), float32)` | the same, and how far to drive |
    | `discrete` | `Discrete(5)` | a curvature of -1, -1/2, 0, 1/2 or 1 over R, from sharp right to sharp left |
    | `target` | `Discrete(K)` | where to go: K = `action.weeds` + `action.views` + 1 (10 + 5 + 1 = 16) |

    `steer` and `discrete` drive for one control period at constant speed. With `drive` the second number a stands for
    (a + 1)/2 of that way, so that a step can end where an arc ends.
    A finite value outside [-1, 1] is clipped, and `info["action_clipped"]` says so.

    A step of `target` is one decision: the mower goes to the candidate along the shortest path of Dubins until it
    arrives, its weed is mowed, or something new is detected, and for 20 km at most. The reward sums what happened on
    the way.

    | index | candidate |
    |---|---|
    | 0 to `weeds` - 1 | the nearest known weeds, nearest first |
    | `weeds` to K - 2 | views of unseen ground, cheapest first: poses that look straight at unseen cells |
    | K - 1 | the search |

    A weed is approached at the cheapest of 16 headings and 3 offsets along the bar (-0.9, 0 or 0.9 of half its width),
    or straight ahead or on full lock where that is cheaper.
    The search goes on with a sweep in ceil(W / S_w) bands, S_w the sensor's width, and then to what lies about unseen;
    when all is seen, to the cheapest weed.
    The last candidate is always open. The others are open where there is such a weed or view, and a way to it that
    stays within the headland; `info["action_mask"]` and `action_masks()` say so. A closed one stands for the last, and
    `info["action_clipped"]` says that it does.

    ## Observation Space

    | `observation.kind` | space |
    |---|---|
    | `features` (default) | `Box((7 + 3k + r,), float32)`, between -1 and 1 (39 numbers) |
    | `candidates` | `Box((18 K,), float32)`, between -1 and 1: K rows of 18, row by row (288 numbers) |
    | `maps` | `Box(0, 255, (12288,), uint8)`: 12 pictures of 32 x 32 points, picture by picture, row by row |
    | `dict` | `Dict` of `features`, `candidates`, `action_mask` (`MultiBinary(K)`, int8) and `maps` |

    Every kind goes with every action kind. With `observation.flat = false` the tables have their shapes, (K, 18) and
    (12, 32, 32); stable-baselines3 warns of both.
    A known weed is one that is detected and not yet mowed. No number has a unit: lengths are scaled as the tables say.

    `features`, with k = `observation.nearest_weeds` and r = `observation.rays` (8 each):

    | index | value | range |
    |---|---|---|
    | 0, 1 | x and y, scaled over the pasture and its headland (at most 10 m), clipped | -1 to 1 |
    | 2, 3 | cosine and sine of the heading | -1 to 1 |
    | 4 | share of the budget left | 0 to 1 |
    | 5 | share of the pasture's cells seen | 0 to 1 |
    | 6 | n / (n + k) for n known weeds | 0 to 1 |
    | 7 + 3i, 8 + 3i | the i-th nearest known weed: forward and left, over length plus width | -1 to 1 |
    | 9 + 3i | 1; all three are 0 where there is no such weed | 0 to 1 |
    | 7 + 3k + j | way to unseen ground at 360 j / r degrees left, over 4 sensor ranges | 0 to 1 |

    `candidates`, a row for each candidate of `target`, zeros where there is none. A length v is written as
    v / (abs(v) + S_d) with the sensor range S_d. The goal is where the shortest path to the candidate ends.

    | column | value | range |
    |---|---|---|
    | 0, 1, 2 | 1 for a weed, for a view, for the search | 0 to 1 |
    | 3, 4 | forward and left offset of the goal, as lengths | -1 to 1 |
    | 5 | its straight distance, as a length | 0 to 1 |
    | 6, 7 | cosine and sine of its bearing | -1 to 1 |
    | 8 | length of the way, as a length | 0 to 1 |
    | 9 | share of what the sensor will show at its end that is unseen ground | 0 to 1 |
    | 10 | share of the whole budget that the way costs | 0 to 1 |
    | 11, 12 | cosine and sine of the heading in which the mower arrives, from its own | -1 to 1 |
    | 13 | by how much the way of the search gets longer if this comes first, as a length | -1 to 1 |
    | 14 | share of the square around the end, two sensor ranges wide, that is unseen ground | 0 to 1 |
    | 15 | from the end with a turn and a straight to the nearest other weed of the table, as a length | 0 to 1 |
    | 16 | share of the pasture's cells seen; the same in every row | 0 to 1 |
    | 17 | n / (n + 10) for n known weeds; the same in every row | 0 to 1 |

    `maps`: picture 3s + c is the channel c at the scale s, from fine to coarse.
    The mower is in the middle and looks up. A point's side is B/8 x 3^s, so with B = 2 m the
    pictures show 8, 24, 72 and 216 m.

    | channel | value of a point | range |
    |---|---|---|
    | 0 | 255 times the share of it that is unseen ground, from sample points | 0 to 255 |
    | 1 | 255 if a known weed lies in it, else 0 | 0 or 255 |
    | 2 | 255 times the share of it that lies outside the pasture, from sample points | 0 to 255 |

    The `NatureCNN` of stable-baselines3 cannot take pictures of 32 x 32 points. With `observation.flat = false` the
    features extractor `swath.training.networks.MapsExtractor` takes `maps`, `swath.training.networks.DictExtractor`
    takes `dict`.

    `observation_names` lists the names of the numbers, part by part; `maps` has one for all.

    ## Starting State

    The weeds are drawn from the seed, or are those of the scenario or of `reset(options={"weeds": array (n, 2)})`.
    The mower stands at (0, B/2) heading +x, or where `mower.start` says.

    ## Reward

    `reward.weed` (1) for each weed mowed, minus `reward.path_per_m` (1) for each metre driven.
    A failure, and standing about until the step limit, charge the path cost of the rest of the budget (of one
    boustrophedon path where the budget has no end), so that quitting never pays.
    The terms are in `info["reward_terms"]`.

    ## Episode End

    | outcome | kind | when |
    |---|---|---|
    | `goal` | terminated | `episode.seen_goal` of the 1 m cells are seen, and every detected weed is mowed |
    | `left_headland` | terminated | a failure: further than `pasture.headland_m` outside the pasture |
    | `budget` | truncated | the path is `episode.budget` boustrophedon paths long; the last step is cut there |
    | `step_limit` | truncated | four times the steps that the budget takes at full speed (`target`: its looks) |

    ## Information

    Every step, and every reset with zeros: `reward_terms` (`weed`, `path`, `failure`) and `action_clipped` (bool).
    With `target` also `elapsed_m`, how far the mower came, in metres, and `action_mask`, which candidates may be chosen
    next: (K,) bool.
    The last info of an episode also holds the keys of `swath.Summary`; before that it holds nothing that the mower
    cannot know.

    ## Arguments

    - `scenario`: a shipped name (`pasture`, `cowbot-field`), a TOML file, a dictionary, a `swath.Scenario`, or None for
      the defaults. A file with `[[sweep]]` is refused.
    - `pasture`, `weeds`, `mower`, `sensor`, `reward`, `episode`, `observation`, `action`: blocks laid over it, as
      dictionaries.
    - `render_mode`: None, `rgb_array` (`render` returns a picture, (height, width, 3) uint8) or `human` (a window shows
      one after every reset and step; needs the extra `swath[human]`). `gym.make` takes `rgb_array_list` too.
    - `render_size`: width and height of a picture in pixels, from (160, 90) to (4096, 4096); (640, 360) by default.

    A picture shows the truth, undetected weeds too. It is for who owns the environment: what an agent may know is in
    the observation. The path is kept from the last reset or `restore` on, and only with a render mode.

    ```python
    env = gym.make("swath/MowerRouting-v0", weeds={"count": 80}, action={"kind": "drive"})
    ```

    Seeds: `reset(seed=s)` begins episode 0 of the seed s, and each later `reset()` the next episode of that seed.
    Only a first `reset()` without a seed draws one from `np_random`.

    ## References

    Maini, Gonultas & Isler (2022), "Online Coverage Planning for an Autonomous Weed Mowing Robot with Curvature
    Constraints".

    ## Version History

    - v0: the first version.
    """

    metadata: ClassVar[dict[str, object]] = {"render_modes": ["human", "rgb_array"], "render_fps": RENDER_FPS}  # type: ignore[misc] # Gymnasium declares no ClassVar

    def __init__(
        self,
        scenario: ScenarioSource = None,
        *,
        render_mode: str | None = None,
        render_size: tuple[int, int] = RENDER_SIZE,
        **blocks: Unpack[Blocks],
    ) -> None:
        """Makes an environment that waits for its first reset.

        Args:
            scenario: A shipped name, a file, a dictionary, a `Scenario`, or None for the defaults.
            render_mode: None, `rgb_array` or `human`.
            render_size: Width and height of a picture, pixels.
            **blocks: Blocks of the scenario, laid over it key by key.

        Raises:
            ConfigError: If the scenario or an argument cannot be used; the message names it.
            ModuleNotFoundError: If pygame is not installed, for `human`; the message names the extra.
        """
        check_render_mode(render_mode, ("human", "rgb_array"))
        self.render_mode = render_mode
        self._screen = Screen("swath") if render_mode == "human" else None
        size = None if render_mode is None else render_size
        self._inner = _native.Env(_native.Scenario(scenario, **blocks), size)
        self._is_closed = False
        self.observation_space = observation_space(self._inner.observation_spec)
        self.action_space = action_space(self._inner.action_spec)

    @property
    def scenario(self) -> Scenario:
        """The scenario with every key resolved."""
        return self._inner.scenario

    @property
    def observation_names(self) -> list[str]:
        """Name of every number of an observation, part by part; one for `maps`, whose numbers are all alike."""
        return [name for _, _, _, bounds in self._inner.observation_spec for name, _, _ in bounds]

    @property
    def core(self) -> _native.Env:
        """The native environment, which native agents act in.

        Raises:
            ClosedError: After `close`.
        """
        if self._is_closed:
            text = "`reset` and `step` must come before `close`"
            raise ClosedError(text)
        return self._inner

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, object] | None = None
    ) -> tuple[Observation, Info]:
        """Begins an episode.

        Args:
            seed: Begins episode 0 of this seed, from 0 to 2**64 - 1. None: the next episode of the present seed.
            options: `{"weeds": array (n, 2)}` places the weeds, world frame, metres, instead of drawing them. Never
                modified.

        Returns:
            observation: As the observation space says, in fresh arrays.
            info: The keys of a step, with zeros.

        Raises:
            ConfigError: If the seed, an option's name or a weed cannot be used; nothing has changed then.
            ClosedError: After `close`.
        """
        core, weeds = self.core, weeds_of_one(options)
        if seed is not None:
            observation, info = core.reset(seed, weeds)
            super().reset(seed=int(seed))
        elif core.has_begun:
            observation, info = core.reset_next(weeds)
        else:
            observation, info = core.reset(drawn_seed(self.np_random), weeds)
        self._show()
        return observation, info

    def step(self, action: npt.ArrayLike) -> tuple[Observation, float, bool, bool, Info]:
        """Drives as `action` says, for at most one control period; with `target` until the mower arrives or detects.

        Args:
            action: Numbers (action_size,), finite and clipped into [-1, 1]; or the index of a choice.

        Returns:
            observation: As the observation space says, in fresh arrays.
            reward: Weeds mowed minus metres driven, weighted.
            terminated: Whether the episode ended by the rules of the problem.
            truncated: Whether it was cut off.
            info: See the class.

        Raises:
            ActionError: If the action has another shape, is not finite or is no choice, before the first reset, and
                after the end of an episode; nothing has moved then.
            ClosedError: After `close`.
        """
        result = self.core.step(action)
        if self._screen is not None:
            self._show()
        return result

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Returns a picture of the environment as it stands.

        Returns:
            picture: (height, width, 3) uint8, a fresh array; None with `human`, whose window shows it, and without a
                render mode.

        Raises:
            ActionError: Before the first reset.
            ClosedError: After `close`.
        """
        if self.render_mode is None:
            gym.logger.warn("`render` returns nothing: the environment was made without a `render_mode`")
            return None
        if self._screen is not None:
            self._screen.show(self.core.render(), waits=False)
            return None
        return self.core.render()

    def _show(self) -> None:
        """Shows a picture in the window, if there is one."""
        if self._screen is not None:
            self._screen.show(self.core.render())

    def close(self) -> None:
        """Ends the use of the environment; closing twice is fine."""
        if self._screen is not None:
            self._screen.close()
        self._is_closed = True

    def action_masks(self) -> npt.NDArray[np.bool_]:
        """Returns which choices of the action are open now, as the maskable algorithms of sb3-contrib ask for it.

        Returns:
            mask: (choices,) bool, a fresh array: True throughout, but for `target`.

        Raises:
            ConfigError: If the action is numbers.
            ActionError: Before the first reset.
            ClosedError: After `close`.
        """
        return self.core.action_masks()

    def snapshot(self) -> bytes:
        """Returns the state of the episode as bytes: all but the scenario and `np_random`."""
        return self.core.snapshot()

    def restore(self, snapshot: bytes) -> None:
        """Puts back what `snapshot` returned, here or in another environment of the same scenario.

        Args:
            snapshot: The bytes.

        Raises:
            SnapshotError: If they are damaged, or of another version or scenario; nothing has changed then.
        """
        self.core.restore(bytes_of(snapshot))
