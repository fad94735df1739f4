"""What Python tests share: how many cases a property gets, an environment of every action kind, commands, a browser."""

import os
import signal

import hypothesis
import pytest
from chromium import CHROMIUM
from contract import KINDS, make

# Windows of `render_mode="human"` open nowhere.
os.environ["SDL_VIDEODRIVER"] = "dummy"

# A shell has what it starts with `&` ignore Ctrl-C, and so would the commands that are started and stopped here.
signal.signal(signal.SIGINT, signal.default_int_handler)

hypothesis.settings.register_profile("default", max_examples=64, deadline=None, derandomize=True)
hypothesis.settings.register_profile("long", max_examples=2000, deadline=None)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))


@pytest.fixture(params=KINDS)
def kind(request):
    return request.param


@pytest.fixture
def env(kind):
    return make(kind)


@pytest.fixture(scope="module")
def server():
    """A server with its defaults; files that need another one have it themselves."""
    from remote_server import Server

    server = Server()
    yield server
    server.end()


@pytest.fixture
def call(capsys):
    """Runs a command in this process: its status, and what it wrote to stdout and stderr."""
    from swath.cli import main  # where there are no commands, such as under the oldest Gymnasium, there is no Typer

    def run(*arguments):
        status = main([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return run


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright  # few tests need it

    assert CHROMIUM is not None, "CI needs chromium: make browser"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM)
        yield browser
        browser.close()
