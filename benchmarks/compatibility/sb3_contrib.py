"""What users of sb3-contrib do."""

from __future__ import annotations

from sb3_contrib import ARS, QRDQN, TQC, TRPO, RecurrentPPO

from benchmarks.compatibility.rows import row
from benchmarks.compatibility.stable_baselines3 import COARSE, FEW, SHORT, batch, single

recurrent_ppo = row("RecurrentPPO, `CnnLstmPolicy`, on `SwarmVecEnv`")(
    lambda: RecurrentPPO("CnnLstmPolicy", batch(), **SHORT).learn(32)
)
trpo = row("TRPO, `CnnPolicy`, on `gymnasium.make(...)`")(
    lambda: TRPO("CnnPolicy", single(), n_steps=16, batch_size=8).learn(32)
)
tqc = row("TQC, `CnnPolicy`, on `SwarmVecEnv`")(lambda: TQC("CnnPolicy", batch(), **FEW).learn(16))
ars = row("ARS, `LinearPolicy`, on `SwarmVecEnv`")(
    lambda: ARS("LinearPolicy", batch(**COARSE), n_delta=2, n_top=1, n_eval_episodes=1).learn(8)
)
qr_dqn = row("QR-DQN, `CnnPolicy`, on `SwarmVecEnv`", action="discrete")(
    lambda **keywords: QRDQN("CnnPolicy", batch(**keywords), **FEW).learn(16)
)
