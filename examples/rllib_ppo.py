"""PPO of RLlib on swath.

    python examples/rllib_ppo.py --iterations 100

With `vector_entry_point` RLlib's runners get swath's native batch; with `sync` they step single environments in a loop.
With `--connect` the environments are on servers, and what is learned is the same to the bit.
"""

from __future__ import annotations

import argparse

import gymnasium as gym
import ray
from ray.rllib.algorithms.ppo import PPOConfig

import swath


def main() -> None:
    """Reads the arguments and trains."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--iterations", type=int, default=100)
    parser.add_argument("--num-envs", type=int, default=32, help="environments of the one runner")
    parser.add_argument("--batch-size", type=int, default=8192, help="steps of one iteration")
    parser.add_argument("--minibatch-size", type=int, default=1024)
    parser.add_argument("--vectorize-mode", choices=["vector_entry_point", "sync"], default="vector_entry_point")
    parser.add_argument("--budget", type=float, default=1.0, help="longest path, in boustrophedon paths")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--connect", action="append", metavar="ENDPOINT", help="a server; again for more")
    arguments = parser.parse_args()

    scenario = {"scenario": "pasture", "weeds": {"count": 20}, "episode": {"budget": arguments.budget}}
    if arguments.connect:
        # A single environment has one server.
        is_batch = arguments.vectorize_mode == "vector_entry_point"
        scenario["connect"] = arguments.connect if is_batch else arguments.connect[0]
    swath.rllib.register()
    config = (
        PPOConfig()
        .environment(swath.rllib.NAME, env_config=scenario)
        .env_runners(
            num_env_runners=0,
            num_envs_per_env_runner=arguments.num_envs,
            gym_env_vectorize_mode=gym.VectorizeMode(arguments.vectorize_mode),
            # Returns are some hundred metres; the connector keeps their scale away from the networks.
            env_to_module_connector=observation_filter,
        )
        .training(
            train_batch_size_per_learner=arguments.batch_size,
            minibatch_size=arguments.minibatch_size,
            num_epochs=8,
            lr=3e-4,
            gamma=0.999,
            lambda_=0.97,
            entropy_coeff=0.001,
            vf_clip_param=1e6,
            grad_clip=0.5,
        )
        .debugging(seed=arguments.seed, log_level="ERROR")
    )
    ray.init(include_dashboard=False, num_cpus=1, log_to_driver=False)
    algorithm = config.build_algo()
    for iteration in range(1, arguments.iterations + 1):
        result = algorithm.train()
        runner = result["env_runners"]
        mean = runner.get("episode_return_mean", "no episode ended")
        print(f"iteration {iteration}: {runner['num_env_steps_sampled_lifetime']:.0f} steps, return {mean}")
    algorithm.stop()
    ray.shutdown()


def observation_filter(env: object, spaces: object, device: object) -> object:
    """Returns RLlib's running normalisation of observations."""
    from ray.rllib.connectors.env_to_module import MeanStdFilter

    return MeanStdFilter()


if __name__ == "__main__":
    main()
