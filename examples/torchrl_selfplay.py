"""TorchRL: PPO on `PettingZooWrapper`; both sides are one group, whose agents share a network (self-play).

pip install torchrl supersuit
python examples/torchrl_selfplay.py --steps 131072
"""

import argparse

import supersuit
import torch
from tensordict.nn import NormalParamExtractor, TensorDictModule
from torchrl.collectors import Collector
from torchrl.envs import MarlGroupMapType, PettingZooWrapper, SerialEnv
from torchrl.modules import MLP, ProbabilisticActor, TanhNormal
from torchrl.objectives import ClipPPOLoss, ValueEstimators

from swarm_pz import GameConfig, ObservationConfig, parallel_env
from swarm_pz.evaluation import play_match

GAME, FRAMES = GameConfig(drones_per_team=5, observation=ObservationConfig(grid=10)), 1024
SEEN, VALUE, LOC, SCALE = (("agents", name) for name in ("observation", "state_value", "loc", "scale"))
NAMES = {name: ("agents", name) for name in ("action", "reward", "done", "terminated")}
parser = argparse.ArgumentParser()
parser.add_argument("--steps", type=int, default=131_072, help="commands to learn from, of both sides")
parser.add_argument("--games", type=int, default=200, help="games against each opponent, even")
options = parser.parse_args()
torch.manual_seed(0)
torch.set_num_threads(1)  # the networks are small


def make():  # SuperSuit converts images to vectors of fractions
    env = supersuit.dtype_v0(supersuit.flatten_v0(parallel_env(GAME, action="modes")), "float32")
    return PettingZooWrapper(supersuit.normalize_obs_v0(env), group_map=MarlGroupMapType.ALL_IN_ONE_GROUP)


envs = SerialEnv(8, make)
actor = torch.nn.Sequential(MLP(900, 10, num_cells=[128, 128]), NormalParamExtractor("biased_softplus_0.5"))
module = TensorDictModule(actor, in_keys=[SEEN], out_keys=[LOC, SCALE])
drawn = {"distribution_class": TanhNormal, "distribution_kwargs": {"low": -2.0, "high": 2.0}, "return_log_prob": True}
keys = {"in_keys": [LOC, SCALE], "out_keys": [NAMES["action"]]}
policy = ProbabilisticActor(module, spec=envs.full_action_spec_unbatched, **keys, **drawn)
critic = TensorDictModule(MLP(900, 1, num_cells=[128, 128]), in_keys=[SEEN], out_keys=[VALUE])
loss = ClipPPOLoss(policy, critic, clip_epsilon=0.2, entropy_coeff=0.0, normalize_advantage=True)
loss.set_keys(value=VALUE, sample_log_prob=("agents", "action_log_prob"), **NAMES)
loss.make_value_estimator(ValueEstimators.GAE, gamma=0.98, lmbda=0.95)
optimizer = torch.optim.Adam(loss.parameters(), 5e-4)
# A collector samples actions and continues games in the next batch. A frame is a step of a game, of both sides.
for batch in Collector(envs, policy, frames_per_batch=FRAMES, total_frames=max(options.steps // 2, FRAMES)):
    loss.value_estimator(batch, params=loss.critic_network_params, target_params=loss.target_critic_network_params)
    flat = batch.reshape(-1).detach()
    for part in (part for _ in range(4) for part in torch.randperm(len(flat)).split(256)):
        losses = loss(flat[part])
        optimizer.zero_grad()
        (losses["loss_objective"] + losses["loss_critic"]).backward()
        torch.nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
        optimizer.step()


class Model:  # matches need only the spaces and `predict`
    side = parallel_env(GAME, action="modes")
    observation_space, action_space = side.observation_space("red_0"), side.action_space("red_0")

    def predict(self, observation, *, deterministic=True):
        mean, _ = actor(torch.as_tensor(observation).flatten(1) / 255)
        return 2 * mean.detach().tanh().numpy(), None


for opponent in ("noise", "uniform"):
    match = play_match(Model(), opponent, games=options.games, seed=1, config=GAME, threads=2)
    print(f"against {opponent}: {match.standing()}, share {match.share():.2f}")
