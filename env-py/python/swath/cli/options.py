"""Arguments that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swath import remote
from swath.errors import ConfigError

__all__ = ["AsJson", "Jobs", "Seed", "TlsCa", "TlsCertificate", "TlsKey", "tls_from"]

Seed = Annotated[int, typer.Option(help="Seed of instance 0; instance i has the seed plus i.")]
Jobs = Annotated[int | None, typer.Option(help="Number of threads.", show_default="all cores")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]
TlsCa = Annotated[Path | None, typer.Option(help="Certificate of the authority, PEM.", show_default="none")]
TlsCertificate = Annotated[Path | None, typer.Option(help="Our own certificate, PEM.", show_default="none")]
TlsKey = Annotated[Path | None, typer.Option(help="Private key of our certificate, PEM.", show_default="none")]


def tls_from(ca: Path | None, certificate: Path | None, key: Path | None) -> dict[str, object] | None:
    """Returns the settings of Zenoh that these files ask for; None without any.

    Raises:
        ConfigError: If only some are there, or one cannot be read.
    """
    if ca is None and certificate is None and key is None:
        return None
    if ca is None or certificate is None or key is None:
        text = "`--tls-ca`, `--tls-certificate` and `--tls-key` must come together, got only some of them"
        raise ConfigError(text)
    return remote.tls(ca=ca, certificate=certificate, key=key)
