"""Training of tactics with Stable-Baselines3."""

import os

# Between two of torch's operations OpenMP's workers wait in a busy loop, on the cores that the
# simulator's threads want by then. Short waits make a training run a quarter faster; this has an
# effect only before torch is imported.
os.environ.setdefault("GOMP_SPINCOUNT", "1000")
