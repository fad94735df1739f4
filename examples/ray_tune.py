"""Ray Tune looks for a learning rate of RLlib's PPO on swath.

    python examples/ray_tune.py --samples 8 --iterations 100

Trials run side by side, one on each core; Ray's own cluster does the same on many machines.
"""

from __future__ import annotations

import argparse
import math

import gymnasium as gym
import ray
from ray import tune
from ray.rllib.algorithms.ppo import PPO, PPOConfig
from ray.tune.search import BasicVariantGenerator

import swath


def main() -> None:
    """Reads the arguments, runs the trials and prints them, the best one first."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=8, help="number of trials")
    parser.add_argument("--iterations", type=int, default=100, help="length of a trial")
    parser.add_argument("--jobs", type=int, help="trials at a time; one a core if not given")
    parser.add_argument("--num-envs", type=int, default=32)
    parser.add_argument("--batch-size", type=int, default=8192, help="steps of one iteration")
    parser.add_argument("--budget", type=float, default=1.0, help="longest path, in boustrophedon paths")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", help="folder for Ray's own results; ~/ray_results if not given")
    arguments = parser.parse_args()

    swath.rllib.register()
    config = (
        PPOConfig()
        .environment(
            swath.rllib.NAME,
            env_config={"scenario": "pasture", "weeds": {"count": 20}, "episode": {"budget": arguments.budget}},
        )
        .env_runners(
            num_env_runners=0,
            num_envs_per_env_runner=arguments.num_envs,
            gym_env_vectorize_mode=gym.VectorizeMode.VECTOR_ENTRY_POINT,
        )
        .training(
            lr=tune.loguniform(1e-5, 1e-2),
            train_batch_size_per_learner=arguments.batch_size,
            minibatch_size=arguments.batch_size // 8,
            num_epochs=8,
            gamma=0.999,
            vf_clip_param=1e6,
            grad_clip=0.5,
        )
        .debugging(seed=arguments.seed, log_level="ERROR")
    )
    ray.init(include_dashboard=False, num_cpus=arguments.jobs, log_to_driver=False)
    tuner = tune.Tuner(
        PPO,
        param_space=config,
        tune_config=tune.TuneConfig(
            num_samples=arguments.samples, search_alg=BasicVariantGenerator(random_state=arguments.seed)
        ),
        run_config=tune.RunConfig(
            storage_path=arguments.out, stop={"training_iteration": arguments.iterations}, verbose=0
        ),
    )
    results = tuner.fit()
    ray.shutdown()
    for error in results.errors:
        raise error
    # A trial whose episodes are longer than it is has no return.
    returns = {result.config["lr"]: result.metrics["env_runners"].get("episode_return_mean") for result in results}
    for lr, mean in sorted(returns.items(), key=lambda pair: -math.inf if pair[1] is None else pair[1], reverse=True):
        print(f"learning rate {lr:.6f}: return {'of no episode' if mean is None else f'{mean:.3f}'}")


if __name__ == "__main__":
    main()
