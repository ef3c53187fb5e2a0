"""Texts of a study as HTML, made from Markdown without raw HTML, pictures or scripts."""

from __future__ import annotations

from markdown_it import MarkdownIt

_markdown = MarkdownIt("commonmark", {"html": False}).enable("table").disable("image")


def html_of(text: str) -> str:
    """Return a text as HTML, whose headings begin at h2, below the page's own, and skip no level."""
    tokens = _markdown.parse(text)
    level = 1
    for token in tokens:
        if token.type in ("heading_open", "heading_close"):
            if token.type == "heading_open":
                level = min(int(token.tag[1]) + 1, level + 1, 6)
            token.tag = f"h{level}"
    return str(_markdown.renderer.render(tokens, _markdown.options, {}))
