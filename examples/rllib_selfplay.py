"""RLlib: PPO with one policy for each side; they learn against each other (self-play).

pip install "ray[rllib]" supersuit
python examples/rllib_selfplay.py --steps 40960
"""

import argparse

import supersuit
import torch
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.columns import Columns
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune.registry import register_env

from swarm_pz import GameConfig, ObservationConfig, parallel_env
from swarm_pz.evaluation import play_match

GAME = GameConfig(drones_per_team=5, observation=ObservationConfig(grid=10))
PPO = {"train_batch_size_per_learner": 2048, "minibatch_size": 256, "num_epochs": 4, "lr": 5e-4, "gamma": 0.98}
parser = argparse.ArgumentParser()
parser.add_argument("--steps", type=int, default=40_960, help="commands to learn from, of both sides")
parser.add_argument("--games", type=int, default=200, help="games against each opponent, even")
options = parser.parse_args()


def make(_):  # SuperSuit converts images to vectors of fractions
    env = supersuit.dtype_v0(supersuit.flatten_v0(parallel_env(GAME, action="modes")), "float32")
    return ParallelPettingZooEnv(supersuit.normalize_obs_v0(env))


register_env("capture", make)
config = PPOConfig().environment("capture").env_runners(num_env_runners=0, num_envs_per_env_runner=8)
config.multi_agent(policies={"red", "blue"}, policy_mapping_fn=lambda agent, *_, **__: agent.removesuffix("_0"))
config.training(**PPO, lambda_=0.95, clip_param=0.2, grad_clip=0.5).debugging(seed=0)
algorithm, commands = config.build_algo(), 0
while commands < options.steps:
    algorithm.train()
    commands = 2 * algorithm.metrics.peek(("env_runners", "num_env_steps_sampled_lifetime"))
red = algorithm.get_module("red")


class Model:  # matches need only the spaces and `predict`
    side = parallel_env(GAME, action="modes")
    observation_space, action_space = side.observation_space("red_0"), side.action_space("red_0")

    def predict(self, observation, *, deterministic=True):
        with torch.no_grad():
            answer = red.forward_inference({Columns.OBS: torch.as_tensor(observation).flatten(1) / 255})
        mean, _ = answer[Columns.ACTION_DIST_INPUTS].chunk(2, dim=1)
        return 2 * mean.clamp(-1, 1).numpy(), None  # RLlib's policies act in [-1, 1], whatever the space


for opponent in ("noise", "uniform"):
    match = play_match(Model(), opponent, games=options.games, seed=1, config=GAME, threads=2)
    print(f"against {opponent}: {match.standing()}, share {match.share():.2f}")
algorithm.stop()
