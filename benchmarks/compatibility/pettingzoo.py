"""What users of PettingZoo do."""

from __future__ import annotations

from typing import Any

from benchmarks.compatibility.rows import SMALL, row


@row()
def parallel() -> None:
    """`parallel_api_test`, `parallel_seed_test`, `max_cycles_test`, `state_test`."""
    from pettingzoo.test import max_cycles_test, parallel_api_test, parallel_seed_test, state_test

    import swarm_pz

    parallel_api_test(swarm_pz.parallel_env(**SMALL), num_cycles=50)
    parallel_seed_test(swarm_pz.parallel_env)
    max_cycles_test(swarm_pz)
    state_test(swarm_pz.env(**SMALL), swarm_pz.parallel_env(**SMALL))


@row()
def aec() -> None:
    """`api_test`, `seed_test`, `render_test`."""
    from pettingzoo.test import api_test, render_test, seed_test

    from swarm_pz import env

    api_test(env(**SMALL), num_cycles=50)
    seed_test(env, num_cycles=10)
    render_test(lambda render_mode: env(render_mode=render_mode, command_period=0.1, **SMALL))


@row(action="normalised")
def flocks(**keywords: Any) -> None:
    """`api_test` of `env(controllers="flocking")`."""
    from pettingzoo.test import api_test

    from swarm_pz import env

    api_test(env(controllers="flocking", **SMALL, **keywords), num_cycles=10)


@row()
def wrappers() -> None:
    """`make`, `ClipOutOfBoundsWrapper`, `OrderEnforcingWrapper`, `parallel_to_aec` and back."""
    import pettingzoo
    from pettingzoo.utils import aec_to_parallel, parallel_to_aec, wrappers

    import swarm_pz

    made = pettingzoo.make("parallel", "swarm_pz/Capture-v0", **SMALL)
    env = aec_to_parallel(wrappers.OrderEnforcingWrapper(wrappers.ClipOutOfBoundsWrapper(parallel_to_aec(made))))
    env.reset(seed=0)
    while env.agents:
        env.step({agent: env.action_space(agent).sample() for agent in env.agents})
