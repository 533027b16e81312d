"""The rules of CONTRIBUTING.md about language that a program can check."""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
REWRITTEN = (
    "depthtrack/__init__.py",
    "depthtrack/__main__.py",
    "depthtrack/api",
    "depthtrack/benchmarks",
    "depthtrack/calibration",
    "depthtrack/cli",
    "depthtrack/closing.py",
    "depthtrack/errors.py",
    "depthtrack/evaluation",
    "depthtrack/export",
    "depthtrack/geometry",
    "depthtrack/hand",
    "depthtrack/live",
    "depthtrack/machine.py",
    "depthtrack/markers",
    "depthtrack/number_text.py",
    "depthtrack/options.py",
    "depthtrack/posture_databases",
    "depthtrack/recording",
    "depthtrack/rendering",
    "depthtrack/report",
    "depthtrack/resources.py",
    "depthtrack/segmentation",
    "depthtrack/selection.py",
    "depthtrack/simd",
    "depthtrack/solver",
    "depthtrack/strict_data.py",
    "depthtrack/synthesis",
    "depthtrack/text_table.py",
    "depthtrack/tracking",
    "depthtrack/types.py",
    "depthtrack/viewing",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "README.md",
    "examples/README.md",
    "docs/benchmarks.md",
    "docs/experiments.md",
    "docs/exports.md",
    "docs/formats.md",
    "docs/joints.md",
    "docs/keypoints.md",
    "docs/limitations.md",
    "docs/live.md",
    "docs/marker-formats.md",
    "docs/marker-synthesis.md",
    "docs/markers.md",
    "docs/metrics.md",
    "docs/parameters.md",
    "docs/rigs.md",
    "examples",
    "tests/api",
    "tests/benchmarks",
    "tests/calibration",
    "tests/cli",
    "tests/evaluation",
    "tests/export",
    "tests/geometry",
    "tests/hand",
    "tests/live",
    "tests/markers",
    "tests/posture_databases",
    "tests/recording",
    "tests/rendering",
    "tests/report",
    "tests/robustness/campaign.py",
    "tests/robustness/images.py",
    "tests/robustness/limits.py",
    "tests/robustness/mutations.py",
    "tests/robustness/readers.py",
    "tests/robustness/test_arguments.py",
    "tests/robustness/test_readers.py",
    "tests/segmentation",
    "tests/simd",
    "tests/solver",
    "tests/support",
    "tests/synthesis",
    "tests/test_errors.py",
    "tests/test_examples.py",
    "tests/test_files.py",
    "tests/test_minimum_requirements.py",
    "tests/test_number_text.py",
    "tests/test_packaging.py",
    "tests/test_selection.py",
    "tests/test_strict_data.py",
    "tests/tracking",
    "tests/viewing",
    "tools",
)
"""Packages, modules and pages that follow the rules so far. Extend it until all are in."""
LONGEST_LINE, LONGEST_SENTENCE = 90, 25
BANNED = re.compile(
    r"\b(tell|tells|telling|told|whoever|so many|of which|second thoughts?|explains? (?:more|little)"
    r"|anybody(?:'s)?|kin)\b",
    re.IGNORECASE,
)
_CODE = re.compile(r"``.*?``|`[^`]*`|\[([^\]]*)\]\([^)]*\)|https?://\S+")
_SENTENCE_END = re.compile(r"(?<!et al)(?<!\b[Ee]q)(?<!Sec)(?<!Fig)(?<!\be\.g)(?<!\bi\.e)[.!?:;](?=\s|$)")


def python_texts(source: str) -> Iterator[tuple[bool, int, str]]:
    """Yield whether a text is a docstring with a first line, its line number, and the text; comments too."""
    for node in ast.walk(ast.parse(source)):
        body = getattr(node, "body", None)
        for place, child in enumerate(body if isinstance(body, list) else []):
            match child:
                case ast.Expr(value=ast.Constant(value=str(text))):
                    owns = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and place == 0
                    yield owns, child.lineno, text
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield False, token.start[0], token.string.lstrip("# ")


def paragraphs(text: str) -> Iterator[str]:
    """Yield the running text of a docstring or page: no code, tables, equations, headings or definition lists."""
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    for block in re.split(r"\n\s*\n|\n(?=\s*(?:[-*|#]|\d+\.)\s)|\n(?=\S[^\n]*:\n)", text):
        lines = [line.strip() for line in block.strip().splitlines()]
        prose = [line for line in lines if not line.startswith(("|", "#", "<", ">>>")) and " = " not in line]
        if prose:
            yield " ".join(prose)


def long_sentences(text: str) -> list[str]:
    sentences = (s for p in paragraphs(text) for s in _SENTENCE_END.split(_CODE.sub(r"\1x", p)))
    return [s.strip() for s in sentences if len(re.findall(r"[^\W\d_][\w'-]*", s)) > LONGEST_SENTENCE]


def faults(path: Path) -> list[str]:
    """Return what is against the rules in a Python file or a page, with line numbers."""
    source = path.read_text(encoding="utf-8")
    texts = list(python_texts(source)) if path.suffix == ".py" else [(False, 1, source)]
    found = []
    for is_docstring, line, text in texts:
        where = f"{path.relative_to(ROOT)}:{line}"
        for number, row in enumerate(text.splitlines(), line):
            found += [f"{path.relative_to(ROOT)}:{number}: {match[0]!r} is banned" for match in BANNED.finditer(row)]
        if is_docstring and len(first := text.strip().splitlines()[0]) > LONGEST_LINE:
            found.append(f"{where}: the first line has {len(first)} characters")
        found += [f"{where}: a sentence of more than {LONGEST_SENTENCE} words: {s}" for s in long_sentences(text)]
    return found


def files_of(name: str) -> list[Path]:
    path = ROOT / name
    return sorted(path.rglob("*.py")) if path.is_dir() else [path]


@pytest.mark.parametrize("name", REWRITTEN)
def test_rewritten_parts_follow_the_rules(name: str) -> None:
    files = files_of(name)
    assert files
    assert [fault for file in files for fault in faults(file)] == []


@pytest.mark.parametrize("word", ["told", "Whoever", "so many-th", "of which", "anybody's", "kin", "explains little"])
def test_banned_words_are_found(word: str) -> None:
    assert BANNED.search(f"This is {word} here.")
    assert not BANNED.search("A kind total of many witches untold.")


def test_long_sentences_are_found_and_tables_are_not() -> None:
    words = "word " * (LONGEST_SENTENCE + 1)
    assert long_sentences(f"Short.\n\n{words}.")
    assert not long_sentences(f"| {words} |\n\n```\n{words}\n```\n\nShort one, `{words}`.")
