"""The settings of Zenoh for a client that shows a certificate."""

from __future__ import annotations

import os
import re
from pathlib import Path

from swath.errors import ConfigError

__all__ = ["tls"]


def tls(
    *, ca: str | os.PathLike[str], certificate: str | os.PathLike[str], key: str | os.PathLike[str]
) -> dict[str, object]:
    """Returns what `zenoh` of `make` and `make_vec` is for servers and routers behind `tls/` endpoints.

    Args:
        ca: The certificate of the authority that clients and servers are signed by, PEM.
        certificate: The client's certificate, PEM; its common name is what the server knows the client by.
        key: The private key of the client's certificate, PEM.

    Raises:
        ConfigError: If a file cannot be read, or is not what it should be.
    """
    files = {"ca": Path(ca), "certificate": Path(certificate), "key": Path(key)}
    for field, file in files.items():
        content = "PRIVATE KEY" if field == "key" else "CERTIFICATE"
        try:
            # Keys are called after their kind too, as in `BEGIN EC PRIVATE KEY`.
            is_fine = re.search(rf"^-----BEGIN [A-Z ]*{content}-----".encode(), file.read_bytes(), re.MULTILINE)
            trouble = None if is_fine else f"there is no {content} in it"
        except OSError as error:
            trouble = error.strerror
        if trouble is not None:
            text = f"`{field}` must be a file in PEM, got {file}: {trouble}"
            raise ConfigError(text)
    return {
        "transport/link/tls": {
            "root_ca_certificate": str(files["ca"]),
            "connect_certificate": str(files["certificate"]),
            "connect_private_key": str(files["key"]),
            "enable_mtls": True,
            "verify_name_on_connect": True,
            "close_link_on_expiration": True,
        }
    }
