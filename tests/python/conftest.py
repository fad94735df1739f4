"""What all Python tests share: how many cases a property gets, and an environment of every action kind."""

import os

import hypothesis
import pytest
from contract import KINDS, make

# Windows of `render_mode="human"` open nowhere.
os.environ["SDL_VIDEODRIVER"] = "dummy"

hypothesis.settings.register_profile("default", max_examples=64, deadline=None, derandomize=True)
hypothesis.settings.register_profile("long", max_examples=2000, deadline=None)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))


@pytest.fixture(params=KINDS)
def kind(request):
    return request.param


@pytest.fixture
def env(kind):
    return make(kind)
