"""What users of PettingZoo do."""

from __future__ import annotations

import pettingzoo
from pettingzoo.test import (
    api_test,
    max_cycles_test,
    parallel_api_test,
    parallel_seed_test,
    render_test,
    seed_test,
    state_test,
)
from pettingzoo.utils import aec_to_parallel, parallel_to_aec
from pettingzoo.utils.wrappers import ClipOutOfBoundsWrapper, OrderEnforcingWrapper

import swarm_pz
from benchmarks.compatibility.rows import SMALL, row
from swarm_pz import env, parallel_env


@row("`parallel_api_test`, `parallel_seed_test`, `max_cycles_test`, `state_test`")
def parallel() -> None:
    parallel_api_test(parallel_env(**SMALL), num_cycles=50)
    parallel_seed_test(parallel_env)
    max_cycles_test(swarm_pz)
    state_test(env(**SMALL), parallel_env(**SMALL))


@row("`api_test`, `seed_test`, `render_test`")
def aec() -> None:
    api_test(env(**SMALL), num_cycles=50)
    seed_test(env, num_cycles=10)
    render_test(lambda render_mode: env(render_mode=render_mode, command_period=0.1, **SMALL))


flocks = row('`api_test` of `env(controllers="flocking")`', action="normalised")(
    lambda **keywords: api_test(env(controllers="flocking", **SMALL, **keywords), num_cycles=10)
)


@row("`make`, `ClipOutOfBoundsWrapper`, `OrderEnforcingWrapper`, `parallel_to_aec` and back")
def wrappers() -> None:
    made = pettingzoo.make("parallel", "swarm_pz/Capture-v0", **SMALL)
    played = aec_to_parallel(OrderEnforcingWrapper(ClipOutOfBoundsWrapper(parallel_to_aec(made))))
    played.reset(seed=0)
    while played.agents:
        played.step({agent: played.action_space(agent).sample() for agent in played.agents})
