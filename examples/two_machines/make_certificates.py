"""Makes an authority and what it signs: a certificate and a key for the router, the server and each client.

    python make_certificates.py --listener router=10.77.1.1,10.77.2.1 --listener field robot laptop

Whoever listens has the addresses under which it is reached in its certificate, 127.0.0.1 and localhost always among
them. The certificates of the others are good for connecting only, so that no client can pass for the router.

Uses the program openssl. Meant for trying: whoever has the folder has every key, the authority's too.
A folder that has an authority keeps it, so that a name can be added later. A name that is there already gets a new
certificate and key in place of its old ones, which is said.
"""

from __future__ import annotations

import argparse
import ipaddress
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = ["127.0.0.1", "localhost"]


def main() -> int:
    """Writes the files and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="common name of a client, and of its files")
    parser.add_argument(
        "--listener",
        action="append",
        default=[],
        metavar="NAME[=HOST,...]",
        help="common name of a router or server, and the addresses or names of its machine",
    )
    parser.add_argument("--days", type=int, default=30, help="how long they are valid")
    parser.add_argument("--out", type=Path, default=Path("certificates"), metavar="DIR")
    arguments = parser.parse_args()
    problem = problem_of(arguments)
    if problem:
        print(f"make_certificates: {problem}", file=sys.stderr)
        return 2
    try:
        make(arguments)
    except OSError as error:
        print(f"make_certificates: cannot use {error.filename}: {error.strerror}", file=sys.stderr)
        return 2
    return 0


def make(arguments: argparse.Namespace) -> None:
    """Writes the files, and says which."""
    arguments.out.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not (arguments.out / "ca.pem").exists():
        make_authority(arguments.out, arguments.days)
    listeners = dict(map(read_listener, arguments.listener))
    for name in [*listeners, *arguments.names]:
        if (arguments.out / f"{name}.key.pem").exists():
            print(f"replaces {arguments.out / name}.pem and {arguments.out / name}.key.pem")
    for name, hosts in listeners.items():
        make_certificate(arguments.out, name, [*HERE, *hosts], arguments.days)
    for name in arguments.names:
        make_certificate(arguments.out, name, [], arguments.days)
    print(f"wrote {arguments.out / 'ca.pem'} and the certificates of {', '.join([*listeners, *arguments.names])}")


def read_listener(text: str) -> tuple[str, list[str]]:
    """Returns the name and the hosts."""
    name, equals, hosts = text.partition("=")
    return name, hosts.split(",") if equals else []


def problem_of(arguments: argparse.Namespace) -> str | None:
    """Returns why the arguments cannot be used."""
    if shutil.which("openssl") is None:
        return "needs the program openssl, which comes with every Linux distribution and macOS"
    listeners = [read_listener(text) for text in arguments.listener]
    names = [*(name for name, _ in listeners), *arguments.names]
    if not names:
        return "`NAME` or `--listener` must be given at least once"
    for name in names:
        if not re.fullmatch(r"[A-Za-z0-9_-]{1,64}", name) or name == "ca":
            return f"`NAME` must be 1 to 64 letters, digits, dashes and underscores, and not ca, got {name!r}"
        if names.count(name) > 1:
            return f"`NAME` must be given once, got {name!r} twice"
    for host in (host for _, hosts in listeners for host in hosts):
        if not re.fullmatch(r"[A-Za-z0-9.:-]{1,253}", host):
            return f"`--listener` must have addresses or names of a machine after its name, got {host!r}"
    if not 1 <= arguments.days <= 3650:
        return f"`--days` must be from 1 to 3650, got {arguments.days}"
    return None


def make_authority(folder: Path, days: int) -> None:
    """Writes ca.pem and ca.key.pem."""
    make_key(folder / "ca.key.pem")
    command = ["req", "-x509", "-new", "-key", folder / "ca.key.pem", "-days", days, "-subj", "/CN=swath authority"]
    usage = ["-addext", "basicConstraints=critical,CA:TRUE", "-addext", "keyUsage=critical,keyCertSign,cRLSign"]
    openssl(*command, *usage, "-out", folder / "ca.pem")


def make_certificate(folder: Path, name: str, hosts: list[str], days: int) -> None:
    """Writes NAME.pem and NAME.key.pem; the certificate is good for listening only where it names hosts."""
    make_key(folder / f"{name}.key.pem")
    extensions = [
        "basicConstraints=critical,CA:FALSE",
        "keyUsage=critical,digitalSignature",
        "extendedKeyUsage=" + ("serverAuth,clientAuth" if hosts else "clientAuth"),
    ]
    if hosts:
        names = (f"{'IP' if is_address(host) else 'DNS'}:{host}" for host in hosts)
        extensions.append("subjectAltName=" + ",".join(names))
    with tempfile.TemporaryDirectory() as scratch:
        wish, file = Path(scratch) / "wish.pem", Path(scratch) / "extensions"
        file.write_text("\n".join(extensions) + "\n")
        openssl("req", "-new", "-key", folder / f"{name}.key.pem", "-subj", f"/CN={name}", "-out", wish)
        signer = ["-CA", folder / "ca.pem", "-CAkey", folder / "ca.key.pem", "-CAcreateserial"]
        openssl("x509", "-req", "-in", wish, *signer, "-days", days, "-extfile", file, "-out", folder / f"{name}.pem")


def make_key(file: Path) -> None:
    """Writes a private key that only its owner may read."""
    file.touch(mode=0o600)
    openssl("genpkey", "-algorithm", "EC", "-pkeyopt", "ec_paramgen_curve:P-256", "-out", file)


def is_address(host: str) -> bool:
    """Whether a host is given by its address."""
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def openssl(*arguments: object) -> None:
    """Runs openssl, and ends with what it says if it fails."""
    run = subprocess.run(["openssl", *map(str, arguments)], capture_output=True, text=True, check=False)
    if run.returncode:
        sys.exit(f"make_certificates: openssl {arguments[0]} failed: {' '.join(run.stderr.split())}")


if __name__ == "__main__":
    sys.exit(main())
