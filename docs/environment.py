"""Write the docstrings of the environment's faces into docs/environment.md, where a repository's page shows them.

python docs/environment.py
"""

from __future__ import annotations

import itertools
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path

import griffe
from griffe import DocstringSectionKind as Kind

PAGE = Path(__file__).with_name("environment.md")
_BLOCK = re.compile(r"(<!-- docstring of ([\w.]+) -->\n).*?(<!-- end -->\n)", re.DOTALL)
_LEAD = re.compile(r"^\*\*([\w ]+)\.\*\* ", re.MULTILINE)


def with_docstrings(page: str) -> str:
    """Return a page with the docstrings that its comments name, as Markdown, each up to the next ``end``."""
    loader = griffe.GriffeLoader(search_paths=[PAGE.parents[1]], docstring_parser="numpy")
    loader.load("swarm_pz")

    def block(match: re.Match[str]) -> str:
        parts = "\n\n".join(_markdown(loader.modules_collection[match[2]]))
        return f"{match[1]}\n{parts}\n\n{match[3]}"

    return _BLOCK.sub(block, page)


def _markdown(described: griffe.Object) -> Iterator[str]:
    """Give a docstring's parts; a paragraph that a bold word leads gets a heading instead."""
    for section in described.docstring.parse("numpy") if described.docstring else ():
        if section.kind is Kind.text:
            yield _LEAD.sub(r"### \1\n\n", section.value)
        elif section.kind is Kind.parameters:
            yield f"### Keywords\n\n```text\n{_signature(described)}\n```"
            yield "\n".join(_entries(section.value))
        elif section.kind is Kind.examples:
            yield from (f"```python\n{text}\n\n```" for kind, text in section.value if kind is Kind.examples)


def _signature(described: griffe.Object) -> str:
    """Return the call, with defaults and without types."""
    words = []
    for parameter in list(described.parameters)[1:]:
        if parameter.kind is griffe.ParameterKind.var_keyword:
            words.append(f"**{parameter.name}")
            continue
        if parameter.kind is griffe.ParameterKind.keyword_only and "*" not in words:
            words.append("*")
        words.append(parameter.name if parameter.default is None else f"{parameter.name}={parameter.default}")
    lines = textwrap.wrap(f"{described.name}({', '.join(words)})", 100, subsequent_indent=" " * 4)
    return "\n".join(lines)


def _entries(keywords: list[griffe.DocstringParameter]) -> Iterator[str]:
    """Give a list's line for each keyword, or for those that one description is of."""
    for description, group in itertools.groupby(keywords, lambda keyword: keyword.description):
        alike = list(group)
        names = ", ".join(f"`{keyword.name}`" for keyword in alike)
        kind = str(alike[0].annotation).strip("()")
        names += f" ({kind})" if len(alike) == 1 and kind != "Any" else ""
        yield f"- {names}" + (f": {' '.join(description.split())}" if description else "")


if __name__ == "__main__":
    PAGE.write_text(with_docstrings(PAGE.read_text()))
