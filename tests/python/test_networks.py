"""The networks: what they must not see apart, and what they must."""

import importlib.util
import os
import re

import gymnasium as gym
import numpy as np
import pytest

if importlib.util.find_spec("sb3_contrib") is None and not os.environ.get("CI"):
    pytest.skip("sb3-contrib is not installed", allow_module_level=True)

import torch
from gymnasium.spaces import Box, Dict, Discrete
from stable_baselines3 import PPO

import swath
from swath.training import networks
from swath.training.candidate_policy import CandidatePolicy
from swath.training.networks import CandidatesExtractor, DictExtractor, MapsExtractor

ROWS, COLUMNS, FEATURES = 16, 18, 39
MAPS = Box(0, 255, (12, 32, 32), np.uint8)
TABLES = {
    "table": Box(-1, 1, (ROWS, COLUMNS)),
    "flat table": Box(-1, 1, (ROWS * COLUMNS,)),
    "dict": Dict({"candidates": Box(-1, 1, (ROWS, COLUMNS)), "features": Box(-1, 1, (FEATURES,)), "maps": MAPS}),
}


def policy_for(space):
    torch.manual_seed(0)
    return CandidatePolicy(space, Discrete(ROWS), lambda _: 1e-3, width=16)


def observation(space, table):
    """Two observations with the same features and the given tables."""
    table = torch.as_tensor(table, dtype=torch.float32)
    if not isinstance(space, Dict):
        return table.reshape(len(table), *space.shape)
    features = torch.linspace(-1, 1, FEATURES).expand(len(table), -1)
    return {"candidates": table, "features": features, "maps": torch.zeros(len(table), *MAPS.shape)}


@pytest.fixture
def table():
    """One table whose last five rows are empty."""
    table = np.random.default_rng(0).uniform(-1, 1, (ROWS, COLUMNS))
    table[-5:] = 0
    return table


@pytest.mark.parametrize("space", TABLES.values(), ids=TABLES)
def test_swapping_candidates_swaps_their_chances_and_leaves_the_value(space, table):
    policy = policy_for(space)
    order = np.random.default_rng(1).permutation(ROWS)
    seen = observation(space, np.stack([table, table[order]]))
    with torch.no_grad():
        logits = policy.get_distribution(seen).distribution.logits
        values = policy.predict_values(seen)
    assert torch.allclose(logits[0][order], logits[1], atol=1e-6)
    assert torch.allclose(values[0], values[1], atol=1e-6)
    assert logits[0].std() > 0


def test_a_candidate_counts_for_the_others(table):
    space = TABLES["table"]
    changed = table.copy()
    changed[0, 5] += 0.5
    policy = policy_for(space)
    with torch.no_grad():
        scores = policy.mlp_extractor.forward_actor(
            policy.extract_features(observation(space, np.stack([table, changed])))
        )
    assert not torch.allclose(scores[0][1:], scores[1][1:], rtol=0, atol=1e-6)


def test_a_masked_candidate_is_never_chosen(table):
    policy = policy_for(TABLES["table"])
    mask = np.zeros((64, ROWS), bool)
    mask[:, [3, 7]] = True
    chosen, _ = policy.predict(np.tile(table, (64, 1, 1)).astype(np.float32), action_masks=mask)
    assert set(chosen) == {3, 7}


def test_an_untrained_policy_hardly_prefers_any_candidate(table):
    policy = policy_for(TABLES["table"])
    with torch.no_grad():
        chances = policy.get_distribution(observation(TABLES["table"], table[None])).distribution.probs
    assert torch.allclose(chances, torch.full_like(chances, 1 / ROWS), atol=0.02)


def test_the_features_of_a_scale_come_from_that_scale_alone():
    extractor = MapsExtractor(MAPS, features_dim=32, channels=4)
    maps = torch.rand(1, 12, 32, 32)
    for scale in range(4):
        changed = maps.clone()
        changed[:, 3 * scale : 3 * scale + 3] = torch.rand(1, 3, 32, 32)
        with torch.no_grad():
            before, after = (extractor.look(seen).unflatten(1, (4, -1))[0] for seen in (maps, changed))
        differs = [not torch.equal(*pair) for pair in zip(before, after, strict=True)]
        assert differs == [other == scale for other in range(4)]


def test_all_parts_of_a_dict_reach_the_features():
    space = Dict({**TABLES["dict"].spaces, "action_mask": gym.spaces.MultiBinary(ROWS)})
    extractor = DictExtractor(space, maps_dim=8)
    assert extractor.features_dim == 8 + FEATURES + ROWS * COLUMNS + ROWS
    parts = {name: torch.zeros(1, *part.shape) for name, part in space.spaces.items()}
    with torch.no_grad():
        zero = extractor(parts)
        for name in parts:
            assert not torch.equal(zero, extractor({**parts, name: parts[name] + 1}))


@pytest.mark.parametrize(("kind", "policy"), [("maps", "CnnPolicy"), ("dict", "MultiInputPolicy")])
def test_the_extractors_that_the_environment_names_read_its_pictures(kind, policy):
    named = dict(re.findall(r"`swath\.training\.networks\.(\w+)`\s+takes `(\w+)`", swath.MowerRoutingEnv.__doc__))
    (extractor,) = (getattr(networks, name) for name, taken in named.items() if taken == kind)
    env = gym.make("swath/MowerRouting-v0", observation={"kind": kind, "flat": False})
    keywords = {"features_extractor_class": extractor}
    model = PPO(policy, env, n_steps=16, batch_size=16, n_epochs=1, device="cpu", policy_kwargs=keywords)
    assert model.learn(16).num_timesteps == 16


def test_a_table_is_read_the_same_with_and_without_its_shape(table):
    flat, shaped = (CandidatesExtractor(TABLES[name], ROWS) for name in ("flat table", "table"))
    assert flat.table_shape == shaped.table_shape == (ROWS, COLUMNS)
    seen = torch.as_tensor(table, dtype=torch.float32)[None]
    assert torch.equal(shaped(seen), flat(seen.flatten(1)))
