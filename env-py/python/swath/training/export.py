"""A trained policy as plain numbers, for the agent `learned`."""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import TYPE_CHECKING

from swath.errors import ConfigError
from swath.files import write_whole

if TYPE_CHECKING:
    from swath.training.policy import Policy

__all__ = ["export_policy"]

MAGIC = b"swathcp1"


def export_policy(policy: Policy, path: str | os.PathLike[str]) -> None:
    """Writes what a `CandidatePolicy` chooses by, without what it values: `agents/src/learned/network.rs` reads it.

    The file holds `swathcp1`, the number of columns and the width as 32-bit numbers, then layer by layer the weights,
    input by input, and the biases as 32-bit floats; all of them little-endian.

    Args:
        policy: The policy; its observations are the table `candidates` alone, not normalised.
        path: The file.

    Raises:
        ConfigError: If it is another policy.
    """
    from torch import nn

    from swath.training.networks import CandidateNetwork

    network = getattr(policy.model.policy, "mlp_extractor", None)
    is_normalized = policy.normalization is not None and policy.normalization.norm_obs
    if not isinstance(network, CandidateNetwork) or network.context_size or is_normalized:
        text = "`policy` must be a `CandidatePolicy` over the observation `candidates` without `norm_obs`"
        raise ConfigError(text)
    layers = [layer for part in (network.encode, network.score) for layer in part.modules()]
    dense = [layer for layer in layers if isinstance(layer, nn.Linear)]
    columns, width = dense[0].in_features, dense[0].out_features
    numbers = [
        values.detach().numpy().astype("<f4").tobytes() for layer in dense for values in (layer.weight.T, layer.bias)
    ]
    write_whole(Path(path), MAGIC + struct.pack("<II", columns, width) + b"".join(numbers))
