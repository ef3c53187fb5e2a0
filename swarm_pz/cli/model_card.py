"""The README.md beside an exported policy, whose metadata model hubs read: what is recorded of it, and no more."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from swarm_pz.errors import CheckpointError, ResultsError, require_extra
from swarm_pz.files import draft_of
from swarm_pz.policies.onnx_policy import digest_of, read_files

README = "README.md"


class _Row(NamedTuple):
    """One figure: what was played, in how many games, what is counted, and its 95 % interval."""

    task: str
    games: int
    measure: str
    value: float
    interval: tuple[float, float]

    @property
    def between(self) -> str:
        """The interval's ends in words; none where all games ended alike, and there was nothing to draw from."""
        low, high = self.interval
        return f"{low:.3f} to {high:.3f}" if high > low else "none"


def write(folder: Path, story: Mapping[str, Any], digest: str, report: Path | None, terms: str) -> None:
    """Write the card of a policy that has been exported.

    Parameters
    ----------
    folder : Path
        Of the exported policy.
    story : mapping
        What the policy's own card says of its training and results.
    digest : str
        The policy's own before it was exported, or empty.
    report : Path, optional
        Folder of a report of ``swarm-pz benchmark``, whose results are shown instead of the card's.
    terms : str
        The license, as hubs name it; if empty, none is named.

    Raises
    ------
    ResultsError
        If the report was changed, is a try, or is of other policies.
    """
    card, model = read_files(folder)
    rows, about = _of_card(story) if report is None else _of_report(report, {digest, digest_of(card, model)})
    front: dict[str, Any] = {
        "library_name": "swarm-pz",
        "pipeline_tag": "reinforcement-learning",
        "tags": ["reinforcement-learning", "pettingzoo", "swarm-pz", "onnx"],
    }
    if terms:
        front["license"] = terms
    if rows:
        front["model-index"] = [{"name": card.name, "results": list(map(_result, rows))}]
    jinja = require_extra("jinja2", "train")
    environment = jinja.Environment(  # of Markdown, not HTML
        undefined=jinja.StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    environment.filters |= {
        "json": lambda value: json.dumps(value, ensure_ascii=False),  # which is YAML, too
        "line": lambda text: " ".join(str(text).split()),
    }
    template = environment.from_string(Path(__file__).with_name("model_card.md.jinja").read_text())
    with draft_of(folder / README) as draft:
        draft.write_text(template.render(front=front, card=card, story=story, rows=rows, about=about), encoding="utf-8")


def _of_card(story: Mapping[str, Any]) -> tuple[list[_Row], str]:
    """Return the matches that a learned policy's card records: one, or some by their opponents."""
    told = story.get("results", {})
    try:
        matches = {told["opponent"]: told} if "opponent" in told else told.get("against", told)
        rows = [
            _Row(f"against {name}", match["games"], "games won", match["wins"] / match["games"], match["win_rate_ci95"])
            for name, match in matches.items()
        ]
    except (ArithmeticError, AttributeError, LookupError, TypeError) as error:
        raise CheckpointError(
            f"the results on the policy's card are none of matches ({error!r}): give those of `swarm-pz benchmark` by "
            "--results"
        ) from error
    return rows, "From matches that the policy's own card records: half of the games as red, half as blue."


def _of_report(folder: Path, digests: set[str]) -> tuple[list[_Row], str]:
    """Return the scores of a report, if a policy with one of these digests is in it."""
    from swarm_pz.standard.report import is_try, read

    report, _ = read(folder)
    found = [one["digest"] for one in report["policies"]]
    if is_try(report):
        raise ResultsError(f"the report in {folder} is a try (--quick), which says nothing about the policy")
    if not digests.intersection(found):
        raise ResultsError(
            f"the report in {folder} is of policies with the digests {', '.join(found)}, and this one has "
            f"{' or '.join(sorted(filter(None, digests)))}: give the report of this policy"
        )
    figures = report["figures"]
    games = {name: sum(one["games"] for one in track["opponents"]) for name, track in figures["tracks"].items()}
    rows = [
        _Row(f"track {name}", games[name], "score", track["score"], track["score_ci95"])
        for name, track in figures["tracks"].items()
    ]
    rows.append(_Row("all tracks", sum(games.values()), "score", figures["score"], figures["score_ci95"]))
    means = f" The values are means of {len(found)} policies of different seeds; this is one." if len(found) > 1 else ""
    return rows, (
        f"From the report of `swarm-pz benchmark`, protocol {report['protocol']['version']}, with the signature "
        f"`{report['signature']}`. A win counts 1, all else 0.{means}"
    )


def _result(row: _Row) -> dict[str, Any]:
    return {
        "task": {"type": "reinforcement-learning"},
        "dataset": {"name": f"swarm-pz, {row.task}", "type": "swarm-pz", "config": row.task},
        "metrics": [
            {
                "type": row.measure.replace(" ", "_"),
                "name": f"{row.measure}, 95 % interval {row.between}, {row.games} games",
                "value": round(row.value, 4),
            }
        ],
    }
