"""Networks for the observations that the networks of stable-baselines3 cannot read."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor, FlattenExtractor
from torch import nn

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stable_baselines3.common.policies import BasePolicy

__all__ = [
    "EXTRACTORS",
    "CandidateNetwork",
    "CandidatesExtractor",
    "DictExtractor",
    "MapsExtractor",
    "candidate_policy",
]

SCALES = 4
"""Scales of the observation `maps`; its channels are scale-major."""


class MapsExtractor(BaseFeaturesExtractor):
    """Features of the observation `maps`, (12, 32, 32): every scale is looked at by convolutions of its own.

    Grouped convolutions after Jonnarth, Zhao & Felsberg (2024), "Learning Coverage Paths in Unknown Environments with
    Deep Reinforcement Learning": one group a scale, then a dense layer over all of them.
    Deviation: two of the later convolutions have stride 2, where theirs keep the size.
    NatureCNN, stable-baselines3's own, cannot take pictures as small as these.
    """

    def __init__(
        self, observation_space: spaces.Space[object], features_dim: int = 256, channels: int = 16, scales: int = SCALES
    ) -> None:
        """Makes the layers.

        Args:
            observation_space: `Box` of shape (scales x channels of a map, 32, 32).
            features_dim: Number of features.
            channels: Channels of a convolution, per scale.
            scales: Number of scales, into which the channels of the maps are grouped.
        """
        super().__init__(observation_space, features_dim)
        shape = observation_space.shape or ()
        # stable-baselines3 refuses parameters by assertions too, and a training turns both into its own error.
        assert len(shape) == 3, f"maps must have three axes (`observation.flat` = false), got the shape {shape}"
        depth, wide = shape[0], scales * channels
        self.look = nn.Sequential(
            nn.Conv2d(depth, wide, kernel_size=2, stride=2, groups=scales),
            nn.ReLU(),
            nn.Conv2d(wide, wide, kernel_size=3, stride=2, padding=1, groups=scales),
            nn.ReLU(),
            nn.Conv2d(wide, wide, kernel_size=3, stride=2, padding=1, groups=scales),
            nn.ReLU(),
            nn.Flatten(),
        )
        with torch.no_grad():
            size = self.look(torch.zeros(1, *shape)).shape[1]
        self.dense = nn.Sequential(nn.Linear(size, features_dim), nn.ReLU())

    def forward(self, maps: torch.Tensor) -> torch.Tensor:
        """Maps (batch, 12, 32, 32) in [0, 1] to (batch, features_dim)."""
        features: torch.Tensor = self.dense(self.look(maps))
        return features


class DictExtractor(BaseFeaturesExtractor):
    """Features of the observation `dict`: `maps` through `MapsExtractor`, every other part as it is, side by side."""

    def __init__(self, observation_space: spaces.Dict, maps_dim: int = 256) -> None:
        """Makes the layers.

        Args:
            observation_space: The parts.
            maps_dim: Number of features of `maps`.
        """
        extractors: dict[str, nn.Module] = {}
        size = 0
        for name, part in observation_space.spaces.items():
            extractor = MapsExtractor(part, maps_dim) if name == "maps" else FlattenExtractor(part)
            extractors[name], size = extractor, size + extractor.features_dim
        super().__init__(observation_space, size)
        self.extractors = nn.ModuleDict(extractors)

    def forward(self, parts: Mapping[str, torch.Tensor]) -> torch.Tensor:
        """Maps the parts, each (batch, ...), to (batch, features_dim)."""
        return torch.cat([extractor(parts[name].float()) for name, extractor in self.extractors.items()], dim=1)


class CandidatesExtractor(BaseFeaturesExtractor):
    """The table `candidates` (K, F) and, from the observation `dict`, `features`, flat and side by side."""

    def __init__(self, observation_space: spaces.Space[object], rows: int) -> None:
        """Remembers the shapes.

        Args:
            observation_space: `Box` of shape (K, F) or (K F,), or a `Dict` that holds it as `candidates`, with or
                without `features`.
            rows: K.
        """
        parts = observation_space.spaces if isinstance(observation_space, spaces.Dict) else None
        table = observation_space if parts is None else parts["candidates"]
        size = spaces.flatdim(table)
        self.table_shape: tuple[int, int] = (rows, size // rows)
        self.context_size = 0 if parts is None or "features" not in parts else spaces.flatdim(parts["features"])
        super().__init__(observation_space, self.context_size + size)

    def forward(self, observation: torch.Tensor | Mapping[str, torch.Tensor]) -> torch.Tensor:
        """Returns (batch, context_size + K F): the features, then the table row by row."""
        if isinstance(observation, torch.Tensor):
            return observation.flatten(1)
        flat = observation["candidates"].flatten(1)
        return torch.cat([observation["features"], flat], dim=1) if self.context_size else flat


class CandidateNetwork(nn.Module):
    """Scores every candidate by itself and in the company of the others, the same way wherever it stands in the table.

    A row is encoded by a network that all rows share; mean and maximum of the rows that are not empty tell each row
    about the others. Swapping two rows swaps their scores and leaves the value as it is.
    """

    def __init__(self, table_shape: tuple[int, int], context_size: int, width: int) -> None:
        """Makes the layers.

        Args:
            table_shape: K rows of F columns.
            context_size: Number of features beside the table.
            width: Width of every layer.
        """
        super().__init__()
        rows, columns = table_shape
        self.rows, self.context_size = rows, context_size
        self.latent_dim_pi, self.latent_dim_vf = rows, width

        def dense(size: int) -> nn.Sequential:
            return nn.Sequential(nn.Linear(size, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU())

        self.encode = dense(columns + context_size)
        self.score = nn.Sequential(dense(3 * width), nn.Linear(width, 1))
        self.judge = dense(2 * width + context_size)

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Maps (batch, context_size + K F) to scores (batch, K) and what the value is made of (batch, width)."""
        encoded, company, context = self._read(features)
        return self._scores(encoded, company), self.judge(torch.cat([company, context], dim=1))

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Returns the scores alone."""
        encoded, company, _ = self._read(features)
        return self._scores(encoded, company)

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        """Returns what the value is made of alone."""
        _, company, context = self._read(features)
        judged: torch.Tensor = self.judge(torch.cat([company, context], dim=1))
        return judged

    def _read(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Returns rows (batch, K, width), their company (batch, 2 width) and the context (batch, context_size)."""
        context, flat = features[:, : self.context_size], features[:, self.context_size :]
        table = flat.unflatten(1, (self.rows, -1))
        is_row = (table != 0).any(dim=2, keepdim=True)
        beside = context.unsqueeze(1).expand(-1, self.rows, -1)
        encoded = self.encode(torch.cat([table, beside], dim=2)) * is_row
        mean = encoded.sum(dim=1) / is_row.sum(dim=1).clamp(min=1)
        # Encoded rows are not negative, so an empty one, which is zero, does not raise the maximum.
        return encoded, torch.cat([mean, encoded.amax(dim=1)], dim=1), context

    def _scores(self, encoded: torch.Tensor, company: torch.Tensor) -> torch.Tensor:
        # The first layer reads a row and its company; what the company contributes is the same for all rows.
        hidden, last = self.score
        first, width = hidden[0], encoded.shape[2]
        own = nn.functional.linear(encoded, first.weight[:, :width])
        shared = nn.functional.linear(company, first.weight[:, width:], first.bias)
        scores: torch.Tensor = last(hidden[1:](own + shared.unsqueeze(1)))
        return scores.squeeze(2)


@functools.cache
def candidate_policy() -> type[BasePolicy]:
    """Returns the class `CandidatePolicy`, which needs sb3-contrib."""
    from swath.training.candidate_policy import CandidatePolicy

    return CandidatePolicy


EXTRACTORS: dict[str, type[BaseFeaturesExtractor]] = {
    "DictExtractor": DictExtractor,
    "FlattenExtractor": FlattenExtractor,
    "MapsExtractor": MapsExtractor,
}
"""What a training configuration may name as `policy.features_extractor_class`."""
