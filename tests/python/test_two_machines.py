"""The example for two machines: a client reaches a server through a router, and only with the right certificate."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import zenoh
from remote_server import SERVER, free_port, needs_server

import swath
from swath.cli import main
from swath.registration import ENV_ID
from swath.remote.watch import Watch

EXAMPLE = Path(__file__).parents[2] / "examples/two_machines"

pytestmark = [
    needs_server,
    pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl"),
    pytest.mark.timeout(90),
]


def certificates(folder, *arguments):
    command = [sys.executable, str(EXAMPLE / "make_certificates.py"), *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The example with its certificates, and one of a name that nobody lists."""
    folder = tmp_path_factory.mktemp("two") / "machines"
    shutil.copytree(EXAMPLE, folder, ignore=shutil.ignore_patterns("certificates", "__pycache__"))
    listeners = ["--listener", "router=10.77.1.1,10.77.2.1", "--listener", "field"]
    made = certificates(folder, *listeners, "robot", "laptop", "stranger")
    assert (made.returncode, made.stderr) == (0, "")
    foreign = certificates(folder, "--out", "foreign", "robot")
    assert foreign.returncode == 0
    return folder


def started(folder, *command):
    process = subprocess.Popen(
        list(map(str, command)), cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert process.stdout is not None
    return process, process.stdout.readline()


@pytest.fixture(scope="module")
def endpoints(folder):
    """Endpoints of a router and of the server behind it."""
    listen = f"tls/127.0.0.1:{free_port()}"
    own = f"tls/127.0.0.1:{free_port()}"
    router, line = started(folder, sys.executable, "router.py", "--listen", listen)
    assert line == f"router ready: {listen}\n"
    flags = ["--connect", listen, "--listen", own, "--grace-ms", "400"]
    server, line = started(folder, SERVER, "--config", "server.toml", *flags)
    assert line == f"swath-server ready: {own} field\n"
    yield listen, own
    for process in (server, router):
        process.send_signal(signal.SIGTERM)
        assert process.wait(10) == 0
        process.stdout.close()


def run_client(folder, endpoint, name, *flags):
    command = [sys.executable, "client.py", "--connect", endpoint, "--name", name, *flags]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)


def papers(folder, name, authority="certificates"):
    of = folder / authority
    return swath.remote.tls(ca=of / "ca.pem", certificate=of / f"{name}.pem", key=of / f"{name}.key.pem")


def test_the_example_runs_between_namespaces_with_no_way_but_the_router(folder):
    probe = ["unshare", "--user", "--map-root-user", "--net", "--mount", "--pid", "--fork", "ip", "netns"]
    tools = all(map(shutil.which, ("unshare", "ip", "bash")))
    if not tools or subprocess.run(probe, capture_output=True, check=False).returncode:
        pytest.skip("network namespaces cannot be made here")
    command = ["./in_namespaces.sh", str(SERVER.resolve()), sys.executable, "--steps", "200"]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=80, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.splitlines() == [
        "router ready: tls/0.0.0.0:7447",
        "swath-server ready: tls/127.0.0.1:7448 field",
        "client: 200 steps of 16 environments, equal to those here, bit for bit",
    ]


@pytest.mark.parametrize("name", ["robot", "laptop"])
def test_steps_through_the_router_are_those_here_to_the_bit(folder, endpoints, name):
    run = run_client(folder, endpoints[0], name, "--steps", "100")
    assert (run.returncode, run.stderr) == (0, "")
    assert run.stdout == "client: 100 steps of 16 environments, equal to those here, bit for bit\n"


def test_a_certificate_that_nobody_lists_gets_silence(folder, endpoints):
    # At the server itself, which knows only its router, a listed client of the router is a stranger too.
    for endpoint, name in ((endpoints[0], "stranger"), (endpoints[1], "robot")):
        run = run_client(folder, endpoint, name, "--deadline-s", "1")
        assert (run.returncode, run.stdout) == (2, "")
        assert len(run.stderr.splitlines()) == 1
        assert run.stderr.startswith("client: ")
        assert "no answer within" in run.stderr
        assert (
            f"no sign of `field` at {endpoint}: not running, called otherwise, or we are not authorised" in run.stderr
        )


def test_a_certificate_of_another_authority_does_not_get_in(folder, endpoints):
    text = f"no server at {endpoints[0]}: nobody listens there, or the certificates do not fit$"
    with pytest.raises(swath.RemoteError, match=text):
        swath.remote.make(ENV_ID, connect=endpoints[0], server="field", zenoh=papers(folder, "robot", "foreign"))


def test_a_client_cannot_declare_the_servers_keys(folder, endpoints):
    config = zenoh.Config()
    settings = {
        "mode": "client",
        "connect/endpoints": [endpoints[0]],
        "scouting/multicast/enabled": False,
        **papers(folder, "laptop"),
    }
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
    with zenoh.open(config) as impostor:
        asked = [
            impostor.declare_queryable(f"swath/v1/field/rpc/{verb}", zenoh.handlers.FifoChannel(64))
            for verb in ("open", "reset", "step")
        ]
        run = run_client(folder, endpoints[0], "robot", "--steps", "20")
        assert (run.returncode, run.stderr) == (0, "")
        assert [queryable.try_recv() for queryable in asked] == [None] * 3


def test_a_lease_holds_through_the_router_and_a_killed_client_makes_room(folder, endpoints):
    code = f"""if True:
        import swath, sys, time
        tls = swath.remote.tls(ca=sys.argv[1], certificate=sys.argv[2], key=sys.argv[3])
        env = swath.remote.make("{ENV_ID}", connect="{endpoints[0]}", server="field", client="robot", zenoh=tls)
        env.reset(seed=0)
        time.sleep(1.5)
        env.step([0.0])
        print("stepped", flush=True)
        time.sleep(60)
    """
    of = folder / "certificates"
    files = [str(of / name) for name in ("ca.pem", "robot.pem", "robot.key.pem")]
    watch = Watch([endpoints[0]], ["field"], zenoh=papers(folder, "laptop"))
    client, line = started(folder, sys.executable, "-c", code, *files)
    # Silent for longer than the grace of 0.4 s: its lease spoke for it.
    assert line == "stepped\n"
    assert watch.read_all()[0].stats["sessions"] == 1
    client.kill()
    client.wait()
    client.stdout.close()
    end_s = time.monotonic() + 10
    while watch.read_all()[0].stats["sessions"]:
        assert time.monotonic() < end_s
        time.sleep(0.05)
    watch.close()


def test_the_server_is_watched_through_the_router(folder, endpoints, capsys):
    of = folder / "certificates"
    files = {"--tls-ca": "ca.pem", "--tls-certificate": "laptop.pem", "--tls-key": "laptop.key.pem"}
    flags = [word for flag, name in files.items() for word in (flag, str(of / name))]
    command = ["top", "--connect", endpoints[0], "--server", "field", "--once", "--every", "0.2", *flags]
    assert main(command) == 0
    assert endpoints[0] in capsys.readouterr().out
    env = swath.remote.make_vec(ENV_ID, 2, connect=endpoints[0], server="field", zenoh=papers(folder, "robot"))
    env.reset(seed=0)
    env.step(np.zeros((2, 1), np.float32))
    env.close()


def test_there_is_no_low_latency_over_tls(folder):
    files = {"--tls-ca": "ca.pem", "--tls-certificate": "field.pem", "--tls-key": "field.key.pem"}
    flags = [word for flag, name in files.items() for word in (flag, f"certificates/{name}")]
    command = [SERVER, "--listen", "tls/127.0.0.1:0", "--low-latency", "--allow-cn", "robot", *flags]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=20, check=False)
    assert (run.returncode, run.stdout) == (2, "")
    text = "`low_latency` must be off where `listen` is not tcp/ and a number of the loopback, got on"
    assert run.stderr == f"swath-server: {text}\n"


def test_keys_are_for_their_owner_only_and_a_name_can_be_added_later(tmp_path):
    assert certificates(tmp_path, "--listener", "router").returncode == 0
    of = tmp_path / "certificates"
    authority = (of / "ca.pem").read_bytes()
    if os.name == "posix":
        assert {file.stat().st_mode & 0o077 for file in of.glob("*.key.pem")} == {0}
    assert certificates(tmp_path, "robot").returncode == 0
    assert (of / "ca.pem").read_bytes() == authority
    key = (of / "robot.key.pem").read_bytes()
    said = certificates(tmp_path, "robot", "laptop").stdout.splitlines()
    assert said[0] == f"replaces {Path('certificates/robot.pem')} and {Path('certificates/robot.key.pem')}"
    assert len(said) == 2
    assert (of / "robot.key.pem").read_bytes() != key
    check = ["openssl", "verify", "-CAfile", of / "ca.pem", of / "router.pem", of / "robot.pem"]
    assert subprocess.run(check, capture_output=True, check=False).returncode == 0


def test_a_clients_certificate_cannot_pass_for_the_router(folder):
    def extensions(name):
        command = ["openssl", "x509", "-text", "-noout", "-in", folder / f"certificates/{name}.pem"]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    for name in ("robot", "laptop", "stranger"):
        text = extensions(name)
        assert "TLS Web Client Authentication" in text
        assert "TLS Web Server Authentication" not in text
        assert "Subject Alternative Name" not in text
    assert "TLS Web Server Authentication" in extensions("router")
    assert "IP Address:127.0.0.1, DNS:localhost, IP Address:10.77.1.1, IP Address:10.77.2.1" in extensions("router")
    assert "IP Address:127.0.0.1, DNS:localhost\n" in extensions("field")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["ca"], "`NAME` must be 1 to 64 letters, digits, dashes and underscores, and not ca, got 'ca'"),
        (["a/b"], "`NAME` must be 1 to 64 letters"),
        (["--listener", "a=b,c/d"], "`--listener` must have addresses or names of a machine after its name, got 'c/d'"),
        (["--listener", "a="], "`--listener` must have addresses or names of a machine after its name, got ''"),
        (["--listener", "a", "--out", "/dev/null/x"], "cannot use /dev/null/x: Not a directory"),
        (["--listener", "a", "a"], "`NAME` must be given once, got 'a' twice"),
        ([], "`NAME` or `--listener` must be given at least once"),
        (["a", "--days", "0"], "`--days` must be from 1 to 3650, got 0"),
    ],
)
def test_certificates_that_cannot_be_made_are_one_line_and_status_2(tmp_path, arguments, text):
    run = certificates(tmp_path, *arguments)
    assert (run.returncode, run.stdout) == (2, "")
    assert text in run.stderr
    assert len(run.stderr.splitlines()) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--config", "nowhere"], "`--config` must be a file with settings of Zenoh, got nowhere: No such file"),
        (["--config", "broken.json5"], "`--config` must be a file with settings of Zenoh, got broken.json5: "),
        (["--config", "empty.json5"], "`listen.endpoints` must be a list of endpoints in empty.json5"),
        (
            ["--config", "empty.json5", "--listen", "here"],
            "`--listen` must be an endpoint such as tls/0.0.0.0:7447, got",
        ),
        (["--config", "empty.json5", "--listen", "tcp/256.0.0.1:1"], "cannot start at tcp/256.0.0.1:1: "),
    ],
)
def test_a_router_that_cannot_start_says_why_in_one_line(tmp_path, arguments, text):
    (tmp_path / "broken.json5").write_text("{")
    (tmp_path / "empty.json5").write_text("{}")
    command = [sys.executable, str(EXAMPLE / "router.py"), *arguments]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr.startswith(f"router: {text}")
    assert len(run.stderr.splitlines()) == 1
    assert "/src/" not in run.stderr


@pytest.mark.parametrize(("field", "content"), [("ca", "CERT"), ("certificate", "CERT"), ("key", "PRIVATE")])
def test_a_file_that_is_not_there_or_is_another_is_named(folder, tmp_path, field, content):
    made = folder / "certificates"
    files = {"ca": made / "ca.pem", "certificate": made / "robot.pem", "key": made / "robot.key.pem"}
    swath.remote.tls(**files)
    with pytest.raises(swath.ConfigError, match=f"`{field}` must be a file in PEM, got .*gone.pem: No such file"):
        swath.remote.tls(**{**files, field: tmp_path / "gone.pem"})
    other = tmp_path / "other.pem"
    other.write_bytes((files["certificate"] if field == "key" else files["key"]).read_bytes())
    with pytest.raises(swath.ConfigError, match=f"`{field}` must be .*other.pem: there is no {content}.* in it$"):
        swath.remote.tls(**{**files, field: other})
