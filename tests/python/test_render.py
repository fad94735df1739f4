"""Pictures of environments, through every front and with the tools that people use."""

import copy
import pickle
import re
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
from contract import ID, actions, make
from gymnasium.wrappers import RecordVideo
from gymnasium.wrappers.vector import RecordVideo as VectorRecordVideo

import swath

SHORT = {"episode": {"budget": 0.05}}
SIZE = (320, 180)


def pictured(kind="steer", **arguments):
    return make(kind, render_mode="rgb_array", render_size=SIZE, **arguments)


def has(picture, colour):
    return bool((picture == np.array(colour, np.uint8)).all(axis=-1).any())


def test_a_picture_is_an_array_of_bytes_and_nobody_elses():
    env = gym.make(ID, render_mode="rgb_array")
    env.reset(seed=7)
    first = env.render()
    assert (first.dtype, first.shape) == (np.uint8, (360, 640, 3))
    kept = first.copy()
    for action in actions(env, 20):
        env.step(action)
    second = env.render()
    assert np.array_equal(first, kept)
    assert not np.shares_memory(first, second)
    assert not np.array_equal(first, second)


@pytest.mark.parametrize("kind", ["steer", "drive", "discrete", "target"])
def test_a_picture_depends_on_the_episode_and_not_on_the_pictures_before(kind):
    often, once = pictured(kind, pasture={"headland_m": np.inf}), pictured(kind, pasture={"headland_m": np.inf})
    for seed in (3, 4):
        often.reset(seed=seed)
        once.reset(seed=seed)
        for action in actions(often, 60, seed):
            often.step(action)
            often.render()
            once.step(action)
        assert np.array_equal(often.render(), once.render())


def test_looking_changes_nothing():
    looked_at, alone = pictured(), make()
    for env in (looked_at, alone):
        env.reset(seed=5)
    for action in actions(alone, 80):
        looked_at.render()
        assert looked_at.step(action)[0].tobytes() == alone.step(action)[0].tobytes()
    assert looked_at.snapshot() == alone.snapshot()


def test_weeds_of_every_state_the_path_and_the_mower_have_colours_of_their_own():
    env = gym.make(ID, render_mode="rgb_array", action={"kind": "drive"}).unwrapped
    # Two weeds on the way, one of which is mowed, and one out of sight.
    env.reset(seed=0, options={"weeds": [[5.0, 1.0], [12.0, 4.0], [80.0, 30.0]]})
    for _ in range(16):
        env.step(np.array([0.0, 1.0], np.float32))
    above_the_legend = env.render()[:300]
    for colour in [(213, 94, 0), (122, 31, 98), (0, 114, 178), (250, 241, 205), (133, 150, 128), (196, 214, 180)]:
        assert has(above_the_legend, colour), colour


@pytest.mark.parametrize("move", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_has_pictures_of_the_same_size(move):
    env = pictured()
    env.reset(seed=0)
    twin = move(env)
    assert twin.render_mode == "rgb_array"
    assert twin.render().shape == env.render().shape == (180, 320, 3)


def test_every_row_of_a_vector_looks_as_the_environment_of_its_seed():
    envs = gym.make_vec(ID, num_envs=3, render_mode="rgb_array", render_size=SIZE, **SHORT)
    assert envs.metadata["render_modes"] == ["rgb_array"]
    singles = [pictured(**SHORT) for _ in range(3)]
    envs.reset(seed=8)
    for row, env in enumerate(singles):
        env.reset(seed=8 + row)
    for step in range(12):
        chosen = np.stack([actions(env, 1, seed=step)[0] for env in singles])
        envs.step(chosen)
        for env, action in zip(singles, chosen, strict=True):
            env.step(action)
    pictures = envs.render()
    assert isinstance(pictures, tuple)
    for picture, env in zip(pictures, singles, strict=True):
        assert np.array_equal(picture, env.render())


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_a_vectors_picture_begins_anew_with_the_episode(mode):
    envs = swath.MowerRoutingVectorEnv(1, render_mode="rgb_array", render_size=SIZE, autoreset_mode=mode, **SHORT)
    alone = pictured(**SHORT)
    envs.reset(seed=2)
    alone.reset(seed=2)
    ended = False
    while not ended:
        *_, terminations, truncations, _ = envs.step(np.zeros((1, 1), np.float32))
        envs.render()
        ended = bool(terminations[0] or truncations[0])
    alone.reset()
    if mode == "NextStep":
        envs.step(np.zeros((1, 1), np.float32))
    if mode == "Disabled":
        envs.reset(options={"reset_mask": np.array([True])})
    assert np.array_equal(envs.render()[0], alone.render())


def test_without_a_render_mode_there_are_no_pictures():
    envs = gym.make_vec(ID, num_envs=2)
    envs.reset(seed=0)
    assert envs.render() is None
    env = make()
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="without a `render_mode`"):
        assert env.render() is None


def test_a_picture_before_the_first_reset_is_refused():
    with pytest.raises(swath.ActionError, match="`reset` must come before"):
        pictured().render()
    with pytest.raises(swath.ActionError, match="`reset` must come before"):
        gym.make_vec(ID, num_envs=2, render_mode="rgb_array").render()


@pytest.mark.parametrize("size", [(0, 0), (640, 89), (5000, 360), (640.5, 360), 640, (640, 360, 3), "big"])
def test_a_size_that_is_none_is_refused(size):
    expected = "`render_size` must be (width, height) in pixels, from (160, 90) to (4096, 4096), got "
    with pytest.raises(swath.ConfigError, match=re.escape(expected)):
        swath.MowerRoutingEnv(render_mode="rgb_array", render_size=size)
    with pytest.raises(swath.ConfigError, match=re.escape(expected)):
        swath.MowerRoutingVectorEnv(2, render_mode="rgb_array", render_size=size)


@pytest.mark.parametrize("size", [(160, 90), (4096, 90), (160, 4096)])
@pytest.mark.parametrize("pasture", [(400.0, 2.0), (2.0, 400.0), (0.5, 0.5)])
def test_every_pasture_fits_into_every_picture(size, pasture):
    env = make(
        render_mode="rgb_array",
        render_size=size,
        pasture={"length_m": pasture[0], "width_m": pasture[1]},
        weeds={"count": 3},
        mower={"deck_width_m": 0.4, "start": "centre"},
    )
    env.reset(seed=0)
    assert env.render().shape == (size[1], size[0], 3)


def test_gymnasium_collects_pictures():
    env = gym.make(ID, render_mode="rgb_array_list", render_size=SIZE)
    env.reset(seed=0)
    for action in actions(env, 3):
        env.step(action)
    pictures = env.render()
    assert [picture.shape for picture in pictures] == [(180, 320, 3)] * 4


def decoded(file):
    """The number of pictures of a film and their size, as ffmpeg reads them."""
    import imageio_ffmpeg

    frames, _ = imageio_ffmpeg.count_frames_and_secs(str(file))
    about = subprocess.run([imageio_ffmpeg.get_ffmpeg_exe(), "-i", file], capture_output=True, text=True, check=False)
    width, height = re.search(r"Video: .* (\d+)x(\d+)", about.stderr).groups()
    return frames, (int(width), int(height))


# MoviePy and Gymnasium's word on a folder that is there.
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning", "ignore:.*Overwriting")
def test_record_video_films_an_episode(tmp_path):
    env = RecordVideo(gym.make(ID, render_mode="rgb_array", render_size=SIZE, **SHORT), str(tmp_path))
    env.reset(seed=0)
    ended, steps = False, 0
    while not ended:
        *_, terminated, truncated, _ = env.step(np.zeros(1, np.float32))
        ended = terminated or truncated
        steps += 1
    env.close()
    (film,) = tmp_path.glob("*.mp4")
    # MoviePy counts by seconds: rounding may cost the last one.
    assert abs(decoded(film)[0] - (steps + 1)) <= 1
    assert decoded(film)[1] == SIZE


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning", "ignore:.*Overwriting")
def test_record_video_films_a_vector(tmp_path):
    envs = gym.make_vec(ID, num_envs=4, render_mode="rgb_array", render_size=SIZE, **SHORT)
    envs = VectorRecordVideo(envs, str(tmp_path), video_aspect_ratio=(1, 1))
    envs.reset(seed=0)
    for _ in range(5):
        envs.step(np.zeros((4, 1), np.float32))
    envs.close()
    assert len(list(tmp_path.glob("*.mp4"))) == 1


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_the_video_recorder_of_stable_baselines3_films_the_tiles(tmp_path):
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.vec_env import VecVideoRecorder

    env = swath.sb3.make_vec_env(ID, num_envs=4, seed=0, render_mode="rgb_array", render_size=SIZE)
    recorder = VecVideoRecorder(env, str(tmp_path), lambda step: step == 0, video_length=10)
    recorder.reset()
    for _ in range(12):
        recorder.step(np.zeros((4, 1), np.float32))
    recorder.close()
    (film,) = tmp_path.glob("*.mp4")
    assert decoded(film)[1] == (2 * SIZE[0], 2 * SIZE[1])


def test_images_of_a_vec_env_are_those_of_its_environments():
    pytest.importorskip("stable_baselines3")
    env = swath.sb3.make_vec_env(ID, num_envs=2, seed=4, render_mode="rgb_array", render_size=SIZE)
    env.reset()
    for row, image in enumerate(env.get_images()):
        alone = pictured()
        alone.reset(seed=4 + row)
        assert np.array_equal(image, alone.render())
    # Tiles of stable-baselines3, in a square as nearly as can be.
    assert env.render().size == 2 * image.size
    assert env.get_attr("render_mode") == ["rgb_array"] * 2


# Modes


def test_a_window_shows_every_step_without_a_screen():
    pygame = pytest.importorskip("pygame")
    env = gym.make(ID, render_mode="human", render_size=SIZE)
    env.reset(seed=0)
    shown = pygame.surfarray.array3d(pygame.display.get_surface())
    assert shown.shape == (320, 180, 3)
    env.step(np.zeros(1, np.float32))
    assert not np.array_equal(shown, pygame.surfarray.array3d(pygame.display.get_surface()))
    assert env.render() is None
    env.close()
    env.close()
    assert not pygame.display.get_init()


def test_a_copy_of_an_environment_with_a_window_has_one_of_its_own():
    pytest.importorskip("pygame")
    env = gym.make(ID, render_mode="human", render_size=SIZE).unwrapped
    env.reset(seed=0)
    other = copy.deepcopy(env)
    env.close()
    other.step(np.zeros(1, np.float32))
    assert other.core.render().shape == (180, 320, 3)
    other.close()


def test_a_window_names_the_extra_when_pygame_is_absent(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    expected = "`render_mode=\"human\"` needs pygame: pip install 'swath[human]'"
    with pytest.raises(ModuleNotFoundError, match=re.escape(expected)):
        swath.MowerRoutingEnv(render_mode="human")


def test_a_render_mode_that_there_is_not_is_refused():
    refused = [
        (swath.MowerRoutingEnv, {"render_mode": "ansi"}, "None or `human` or `rgb_array`"),
        (swath.MowerRoutingVectorEnv, {"render_mode": "human"}, "None or `rgb_array`"),
    ]
    for make_env, arguments, expected in refused:
        with pytest.raises(swath.ConfigError, match=f"`render_mode` must be {expected}, got "):
            make_env(**arguments)
    with pytest.raises(swath.ConfigError, match="`render_mode` must be None or `rgb_array`, got 'human'"):
        swath.sb3.make_vec_env(ID, render_mode="human")
    with pytest.raises(swath.ConfigError, match="`render_mode` must be None, got 'rgb_array'"):
        swath.sb3.make_vec_env(ID, render_mode="rgb_array", connect="tcp/127.0.0.1:1")


@pytest.mark.parametrize("make_far", [swath.remote.make, swath.remote.make_vec])
def test_environments_elsewhere_have_no_pictures(make_far):
    expected = "`render_mode` must be None, since there are no pictures of environments elsewhere, got 'rgb_array'"
    with pytest.raises(swath.ConfigError, match=expected):
        make_far(ID, connect="tcp/127.0.0.1:1", render_mode="rgb_array")
