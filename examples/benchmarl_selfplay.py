"""BenchMARL: IPPO; each side is a group with a network of its own, and they learn against each other (self-play).

pip install benchmarl supersuit
python examples/benchmarl_selfplay.py --steps 131072
"""

import argparse
import itertools
from dataclasses import replace

import supersuit
import torch
from benchmarl.algorithms import IppoConfig
from benchmarl.environments.pettingzoo.common import PettingZooClass
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from tensordict import TensorDict
from torchrl.envs import ExplorationType, PettingZooWrapper, set_exploration_type

from swarm_pz import GameConfig, ObservationConfig, parallel_env
from swarm_pz.evaluation import play_match

GAME = GameConfig(drones_per_team=5, observation=ObservationConfig(grid=10))
parser = argparse.ArgumentParser()
parser.add_argument("--steps", type=int, default=131_072, help="commands to learn from, of both sides")
parser.add_argument("--games", type=int, default=200, help="games against each opponent, even")
options = parser.parse_args()
torch.set_num_threads(1)  # the networks are small


class Capture(PettingZooClass):  # BenchMARL's class knows only the games that come with PettingZoo
    def get_env_fun(self, num_envs, continuous_actions, seed, device):
        seeds, groups = itertools.count(seed or 0), {"red": ["red_0"], "blue": ["blue_0"]}

        def make():  # SuperSuit converts images to vectors of fractions
            env = supersuit.dtype_v0(supersuit.flatten_v0(parallel_env(GAME, action="modes")), "float32")
            env = supersuit.normalize_obs_v0(env)
            return PettingZooWrapper(env, group_map=groups, seed=next(seeds), device=device)

        return make

    def supports_continuous_actions(self):
        return True


config = replace(ExperimentConfig.get_from_yaml(), gamma=0.98, lr=5e-4, clip_grad_val=0.5, evaluation=False, loggers=[])
config = replace(config, max_n_iters=max(options.steps // 2048, 1), max_n_frames=None, on_policy_n_envs_per_worker=8)
config.on_policy_collected_frames_per_batch, config.on_policy_minibatch_size = 1024, 256
config.on_policy_n_minibatch_iters, config.create_json = 4, False
ippo = replace(IppoConfig.get_from_yaml(), lmbda=0.95, scale_mapping="biased_softplus_0.5")
network = replace(MlpConfig.get_from_yaml(), num_cells=[128, 128])
experiment = Experiment(Capture("capture", {"max_cycles": 300}), ippo, network, seed=0, config=config)
experiment.run()


class Model:  # matches need only the spaces and `predict`
    side = parallel_env(GAME, action="modes")
    observation_space, action_space = side.observation_space("red_0"), side.action_space("red_0")

    def predict(self, observation, *, deterministic=True):
        images = (torch.as_tensor(observation).flatten(1) / 255)[:, None]  # a group of one
        with torch.no_grad(), set_exploration_type(ExplorationType.DETERMINISTIC):
            answer = experiment.group_policies["red"](TensorDict({"red": {"observation": images}}, len(images)))
        return answer["red", "action"][:, 0].numpy(), None


for opponent in ("noise", "uniform"):
    match = play_match(Model(), opponent, games=options.games, seed=1, config=GAME, threads=2)
    print(f"against {opponent}: {match.standing()}, share {match.share():.2f}")
