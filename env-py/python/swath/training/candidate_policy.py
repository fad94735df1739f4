"""The policy for the action kind `target`."""

from __future__ import annotations

import torch
from gymnasium import spaces
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy
from stable_baselines3.common.type_aliases import Schedule
from torch import nn

from swath.training.networks import CandidateNetwork, CandidatesExtractor

__all__ = ["CandidatePolicy"]


class CandidatePolicy(MaskableActorCriticPolicy):
    """MaskablePPO's policy over a table of candidates: one score a row, from a network that all rows share.

    It reads the observation `candidates`, or `candidates` and `features` out of `dict`.
    """

    def __init__(
        self,
        observation_space: spaces.Space[object],
        action_space: spaces.Discrete,
        lr_schedule: Schedule,
        width: int = 64,
        normalize_images: bool = True,  # noqa: FBT001, FBT002 - the base class's argument
        optimizer_kwargs: dict[str, float] | None = None,
    ) -> None:
        """Makes the layers and the optimiser.

        Args:
            observation_space: The table of shape (K, F), or a `Dict` with it.
            action_space: `Discrete(K)`.
            lr_schedule: Learning rate over the share of the training that is left.
            width: Width of every layer.
            normalize_images: Whether bytes are divided by 255.
            optimizer_kwargs: Keyword arguments of Adam.
        """
        self.width = width
        super().__init__(
            observation_space,
            action_space,
            lr_schedule,
            net_arch=[],
            features_extractor_class=CandidatesExtractor,
            features_extractor_kwargs={"rows": int(action_space.n)},
            normalize_images=normalize_images,
            optimizer_kwargs=optimizer_kwargs,
        )

    def _build_mlp_extractor(self) -> None:
        extractor = self.features_extractor
        assert isinstance(extractor, CandidatesExtractor), "this policy chose its extractor"
        self.mlp_extractor = CandidateNetwork(extractor.table_shape, extractor.context_size, self.width)

    def _build(self, lr_schedule: Schedule) -> None:
        super()._build(lr_schedule)
        # The scores are the logits. Small ones at first: the untrained policy hardly prefers any candidate.
        self.action_net = nn.Identity()
        with torch.no_grad():
            last = self.mlp_extractor.score[-1]
            last.weight.mul_(0.01)
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)

    def _get_constructor_parameters(self) -> dict[str, object]:
        names = ("observation_space", "action_space", "normalize_images")
        data = {name: value for name, value in super()._get_constructor_parameters().items() if name in names}
        return {
            **data,
            "lr_schedule": self._dummy_schedule,
            "width": self.width,
            "optimizer_kwargs": self.optimizer_kwargs,
        }
