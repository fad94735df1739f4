"""What all Python tests share: how many cases a property gets."""

import os

import hypothesis

hypothesis.settings.register_profile("default", max_examples=64, deadline=None, derandomize=True)
hypothesis.settings.register_profile("long", max_examples=2000, deadline=None)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))
