"""Pages that `make docs` makes of other files.

They are README and the documents beside it, the examples, and the API.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import griffe
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "depthtrack"
DOCUMENTS = {"README.md": "index.md", **{f"{name}.md": f"{name}.md" for name in ("ARCHITECTURE", "CONTRIBUTING")}}
DOCUMENTS["CHANGELOG.md"] = "CHANGELOG.md"
"""Documents of the root, and their names among the pages."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages."""
    for name, page in DOCUMENTS.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        files.append(File.generated(config, page, content=moved(text)))
    files.append(File.generated(config, "examples.md", content=examples_page()))
    packages = list(package_pages())
    files.append(File.generated(config, "api/index.md", content=api_page([name for name, _ in packages])))
    pages = [{"Public names": "api/index.md"}, *({name: f"api/{name}.md"} for name, _ in packages)]
    config.nav = [{"API": pages} if "API" in entry else entry for entry in config.nav or []]
    for name, text in packages:
        files.append(File.generated(config, f"api/{name}.md", content=text))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Let pages under docs/ refer to documents of the root."""
    return re.sub(r"\]\(\.\./([A-Z]+\.md)", lambda found: f"]({DOCUMENTS.get(found[1], found[1])}", markdown)


def moved(text: str) -> str:
    """Return a document of the root with the links that it has as a page."""
    text = re.sub(r"\]\(docs/", "](", text)
    text = re.sub(r"\]\(examples/?[^)]*\)", "](examples.md)", text)
    text = re.sub(r"\]\((CITATION\.cff|LICENSE)\)", "]", text)
    return re.sub(r"\]\(README\.md", "](index.md", text)


def examples_page() -> str:
    """Return the overview of the examples, and their sources."""
    folder = ROOT / "examples"
    overview = (folder / "README.md").read_text(encoding="utf-8")
    sources = (
        f"## {path.name}\n\n```python\n{path.read_text(encoding='utf-8')}```\n" for path in sorted(folder.glob("*.py"))
    )
    return "\n".join([re.sub(r"\]\((\w+)\.py\)", r"](#\1py)", overview), *sources])


def api_page(packages: list[str]) -> str:
    """Return the public names, with links to their documentation, and the list of packages."""
    rows = [f"| [`{name}`][{place}] | {summary} |" for name, place, summary in public_names()]
    return "\n".join(
        [
            "# API\n",
            "Names of `import depthtrack`. Each is loaded at its first use.\n",
            "| name | |",
            "| --- | --- |",
            *rows,
            "\n## Packages\n",
            "All modules. Names outside the table above may change in a minor version.\n",
            *(f"- [{name}]({name}.md)" for name in packages),
        ]
    )


def public_names() -> Iterator[tuple[str, str, str]]:
    """Yield public names, full names and first lines, by the imports for type checkers."""
    for name, member in griffe.load("depthtrack", search_paths=[ROOT]).members.items():
        if isinstance(member, griffe.Alias) and member.target_path.startswith("depthtrack."):
            text = member.final_target.docstring
            yield name, member.final_target.path, "" if text is None else text.value.partition("\n")[0]


def package_pages() -> Iterator[tuple[str, str]]:
    """Yield title and page of each package, without the command line, and of the single modules."""
    modules = [path for path in sorted(PACKAGE.glob("*.py")) if not path.name.startswith("__")]
    yield "depthtrack", reference("depthtrack: single modules", modules)
    for folder in sorted(path for path in PACKAGE.iterdir() if (path / "__init__.py").is_file()):
        modules = [path for path in sorted(folder.rglob("*.py")) if path.name != "__init__.py"]
        if folder.name != "cli" and modules:
            yield f"depthtrack.{folder.name}", reference(f"depthtrack.{folder.name}", modules)


def reference(title: str, modules: list[Path]) -> str:
    """Return a page of modules, for mkdocstrings to fill."""
    names = (path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".") for path in modules)
    return "\n".join([f"# {title}\n", *(f"::: {name}\n" for name in names)])
