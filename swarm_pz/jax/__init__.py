"""The default game as pure functions of JAX (`pip install "swarm-pz[jax]"`).

`reset` and `step` play one game; `swarm_pz.jax.environments` wraps it for JaxMARL and Gymnax, and
`swarm_pz.jax.players` holds opponents.
"""

from swarm_pz.errors import require_extra

require_extra("jax", "jax")

from swarm_pz.jax.game import begin, reset, see, step, step_once  # noqa: E402
from swarm_pz.jax.params import Params, State, make_params  # noqa: E402

__all__ = ["Params", "State", "begin", "make_params", "reset", "see", "step", "step_once"]
