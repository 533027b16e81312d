"""Lists of arrays in docstrings, and their examples, as Markdown."""

import re
from textwrap import dedent
from typing import Any

import griffe

_ENTRY = re.compile(r"^(`?[\w.*]+`?(?:, `?[\w.*]+`?)*): (?=\S)", re.MULTILINE)
_EXAMPLE = re.compile(r"^Example:\n((?:[ ]{4}.*\n?|\n)+)", re.MULTILINE)


def as_markdown(text: str) -> str:
    """Return a docstring with a list of its arrays, and its example as a block of code."""
    text = _EXAMPLE.sub(lambda found: f"Example:\n\n```python\n{dedent(found[1]).strip()}\n```\n", text)
    lines: list[str] = []
    for line in text.split("\n"):
        entry = _ENTRY.match(line)
        if entry and not (lines and (lines[-1].startswith(("- ", "    ")) or not lines[-1])):
            lines.append("")
        lines.append(f"- `{entry[1].strip('`')}`: {line[entry.end() :]}" if entry else line)
    return "\n".join(lines)


class MarkdownDocstrings(griffe.Extension):
    """Rewrites each docstring as it is read."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring.value)
