"""Additions to MkDocs: formulas as MathML, pages for linked files and tables, the board, and the game."""

from __future__ import annotations

import csv
import json
import posixpath
import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

from benchmarks.board import ENTRIES
from benchmarks.board.page import build
from swarm_pz.cli.play import site_files
from swarm_pz.play import protocol

_LINK = re.compile(r"\]\(([\w./-]+)((?:#[^)\s]*)?)\)")
_LANGUAGES = {
    ".py": "python", ".js": "javascript", ".html": "html", ".toml": "toml", ".json": "json", ".md": "markdown",
    ".yaml": "yaml", ".cpp": "cpp", ".rs": "rust", "": "bash",
}  # fmt: skip
_ENTRIES = "docs/board/entries"
"""The board in a clone; on the site it is a page."""
_shown: dict[str, str] = {}
"""Files of the repository that are shown as pages: path from its root -> path of the page."""
_SCHEMA = "protocol.schema.json"


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Render fences called ``math`` as MathML, which needs no script; code hosts such as GitHub render them, too."""
    fence = {"name": "math", "class": "math", "format": _as_mathml}
    config.mdx_configs.setdefault("pymdownx.superfences", {})["custom_fences"] = [fence]
    return config


def _as_mathml(source: str, *_: Any, **__: Any) -> str:
    return f'<div class="formula">{convert(source.strip(), display="block")}</div>'


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Make pages of the repository's files that pages link to; add the board, the game and the protocol's schema."""
    for name, data in site_files().items():
        files.append(File.generated(config, f"game/{name}", content=data, inclusion=InclusionLevel.INCLUDED))
    for name, text in build(ENTRIES).items():
        files.append(File.generated(config, f"board/{name}", content=text, inclusion=InclusionLevel.INCLUDED))
    text = json.dumps(protocol.schema(), indent=2)
    files.append(File.generated(config, _SCHEMA, content=text, inclusion=InclusionLevel.INCLUDED))
    root = Path(config.config_file_path).parent
    _shown.clear()
    _shown[_ENTRIES] = "board/index.html"
    for page in list(files.documentation_pages()):
        for target, _ in _LINK.findall(page.content_string):
            path = _outside(page.src_uri, target)
            if path is None or path in _shown or not (root / path).is_file():
                continue
            shown = f"source/{path}.md"
            content = f"---\nsearch:\n  exclude: true\n---\n# {path}\n\n{_as_page(root / path)}"
            files.append(File.generated(config, shown, content=content, inclusion=InclusionLevel.NOT_IN_NAV))
            _shown[path] = shown
    return files


def _as_page(path: Path) -> str:
    """Return a file as Markdown: CSV as a table, a notebook cell by cell, anything else as code."""
    text = path.read_text()
    if path.suffix == ".csv":
        head, *rows = csv.reader(text.splitlines())
        lines = (" | ".join(cell.replace("|", "\\|") for cell in row) for row in (head, ["---"] * len(head), *rows))
        return "\n".join(f"| {line} |" for line in lines)
    if path.suffix != ".ipynb":
        return _fenced(text, _LANGUAGES.get(path.suffix, "text"))
    cells = [(cell["cell_type"], "".join(cell["source"])) for cell in json.loads(text)["cells"]]
    return "\n\n".join(_fenced(f"{said}\n", "python") if kind == "code" else said for kind, said in cells)


def _fenced(text: str, language: str) -> str:
    return f"`````{language}\n{text}`````\n"


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Point links to the repository's files at their pages; broken links stay, and the build refuses them."""
    if page.file.src_uri.startswith("api/"):
        page.meta.setdefault("search", {"boost": 0.5})  # a search ranks explanations above the API reference

    def point(match: re.Match[str]) -> str:
        path = _outside(page.file.src_uri, match[1])
        if path not in _shown:
            return match[0]
        return f"]({posixpath.relpath(_shown[path], posixpath.dirname(page.file.src_uri))}{match[2]})"

    return _LINK.sub(point, markdown)


def _outside(page: str, target: str) -> str | None:
    """Return a link's path from the repository's root, or None if it is outside, or the site has the file."""
    path = posixpath.normpath(posixpath.join("docs", posixpath.dirname(page), target))
    is_of_the_site = (
        path.startswith("docs/")
        and not path.endswith((".py", ".csv", ".txt", ".conf", ".toml", ".yaml"))
        and path != _ENTRIES
    )
    return None if path.startswith("..") or is_of_the_site else path
