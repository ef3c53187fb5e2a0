"""README.md of an exported policy: metadata that model hubs read, training and results."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

TEMPLATE = """\
---
library_name: swarm-pz
pipeline_tag: reinforcement-learning
tags: [reinforcement-learning, pettingzoo, swarm-pz, onnx]
---

# {name}

A policy for swarm-pz, a PettingZoo environment in which two swarms of drones capture each other. `policy.onnx` holds
the network; `policy.json` holds its observations and how its output is read.

```bash
swarm-pz evaluate FOLDER --opponent uniform
```

Trained by `{command}`. Games, half of them as red, half as blue:

| opponent | games | won | drawn | lost |
|---|---|---|---|---|
{results}
"""


def write(folder: Path, name: str, story: Mapping[str, Any]) -> None:
    """Write README.md into the folder of an exported policy; `story` is the card that training wrote, or empty."""
    found = story.get("results", {})
    matches = {found["opponent"]: found} if "opponent" in found else found.get("against", found)
    keys = ("games", "wins", "draws", "losses")
    rows = [f"| {one} | {' | '.join(str(match[key]) for key in keys)} |" for one, match in matches.items()]
    text = TEMPLATE.format(name=name, command=story.get("command", "unknown"), results="\n".join(rows))
    (folder / "README.md").write_text(text, encoding="utf-8")
