"""A study's tables as a Psych-DS data set (schema 1.5), for search engines and programs that know the standard.

`dataset_description.json` is a schema.org Dataset that describes every column. File names are pairs of a key
and a value.
"""

from __future__ import annotations

import json
import unicodedata
from pathlib import Path
from typing import Any

from swarm_pz.play.recordings.tables import write_table
from swarm_pz.play.studies.reading import StudyData
from swarm_pz.play.studies.report import markdown
from swarm_pz.play.studies.rows import TABLES, codebook


def write_psychds(data: StudyData, folder: Path) -> None:
    """Write a study's tables as a Psych-DS data set, into a new folder."""
    (folder / "data").mkdir(parents=True)
    title = data.study.title
    words = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode()
    study = "".join(filter(str.isalnum, words)) or "study"
    for name, kind in TABLES.items():
        write_table(data.table(name), kind, folder / "data" / f"study-{study}_description-{name}_data.csv")
    about = (
        f"Games of two swarms of drones, played by {len(data.remaining)} participants under the conditions "
        f"{', '.join(one.title for one in data.study.conditions)}: what each of them commanded, took and answered. "
        "Written by swarm-pz from the recordings."
    )
    description = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": title,
        "description": about,
        "keywords": ["swarm-pz", "human-swarm interaction", "drones"],
        "variableMeasured": _variables(),
    }
    write_json(description, folder / "dataset_description.json")
    (folder / "README.md").write_text(f"# {markdown(title)}\n\n{markdown(about)}\n", encoding="utf-8")


def _variables() -> list[dict[str, Any]]:
    """Return all columns, each once: what it is in each of its tables, and its unit."""
    found: dict[str, dict[str, Any]] = {}
    for name, table in codebook().items():
        for column, told in table["columns"].items():
            known = found.setdefault(column, {"@type": "PropertyValue", "name": column, "description": ""})
            known["description"] += f"{'; ' if known['description'] else ''}in {name}: {told['about']}"
            known |= {"unitText": told["unit"]} if told["unit"] else {}
    return list(found.values())


def write_json(content: Any, path: Path) -> None:
    """Write plain values as a file that people read, too."""
    path.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
