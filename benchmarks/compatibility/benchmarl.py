"""What users of BenchMARL do."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from typing import Any

from benchmarks.compatibility.rows import SMALL, row
from swarm_pz import parallel_env


@row(
    "IPPO, a group a side, two iterations, on a `PettingZooClass` that makes `PettingZooWrapper`",
    flatten_actions=True,
    observation_dtype="float32",
)
def two_groups(**keywords: Any) -> None:
    from benchmarl.algorithms import IppoConfig
    from benchmarl.environments.pettingzoo.common import PettingZooClass
    from benchmarl.experiment import Experiment, ExperimentConfig
    from benchmarl.models.mlp import MlpConfig
    from torchrl.envs import PettingZooWrapper

    global Capture  # BenchMARL pickles the task when it begins

    class Capture(PettingZooClass):
        def get_env_fun(self, **_: Any) -> Any:
            return lambda: PettingZooWrapper(parallel_env(**SMALL, **keywords))

        def supports_continuous_actions(self) -> bool:
            return True

    with tempfile.TemporaryDirectory() as folder:
        config = replace(
            ExperimentConfig.get_from_yaml(),
            max_n_iters=2,
            max_n_frames=None,
            on_policy_collected_frames_per_batch=20,
            on_policy_n_envs_per_worker=2,
            on_policy_n_minibatch_iters=1,
            on_policy_minibatch_size=10,
            evaluation=False,
            loggers=[],
            create_json=False,
            save_folder=folder,
        )
        model = replace(MlpConfig.get_from_yaml(), num_feature_dims=3)
        experiment = Experiment(Capture("capture", SMALL), IppoConfig.get_from_yaml(), model, seed=0, config=config)
        experiment.run()
    assert experiment.total_frames == 40
    assert set(experiment.group_policies) == {"red", "blue"}
