"""The documents agree with the code: generated pages, links, packages, files, names and options."""

import ast
import re
import runpy
from pathlib import Path

import pytest

from depthtrack import __version__
from depthtrack.markers.filling.options import FillOptions
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.options import parameters
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.configuration import CONFIGURATIONS
from tests.test_architecture import LAYERS

ROOT = Path(__file__).parents[1]
PARAMETERS = runpy.run_path(str(ROOT / "tools" / "generate_parameters.py"))
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), ROOT / "examples" / "README.md"])
PAGES = pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
CURRENT = pytest.mark.parametrize(
    "path", [path for path in DOCUMENTS if path.name != "CHANGELOG.md"], ids=lambda path: str(path.relative_to(ROOT))
)
"""The changelog also names what was renamed."""
OTHER_OPTIONS = {"check", "help", "only"}
"""Options of scripts, and the one that every command has."""


def command_line_options() -> set[str]:
    """Return all options of the commands, as their dataclasses and the configurations state them."""
    found = set(OTHER_OPTIONS)
    for path in (ROOT / "depthtrack" / "cli").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                found.add(node.target.id.replace("_", "-"))
    configurations = [("", make) for make in CONFIGURATIONS.values()]
    others = (("segmentation.", SegmentationOptions), ("labelling.", LabellingOptions), ("", FillOptions))
    for prefix, make in (*configurations, *others):
        for each in parameters(make()):
            found |= {prefix + each.name.replace("_", "-"), prefix + each.path.replace("_", "-")}
    return found | {f"no-{name}" for name in found}


def test_the_page_of_parameters_is_up_to_date() -> None:
    up_to_date = PARAMETERS["PAGE"].read_text(encoding="utf-8") == PARAMETERS["page"]()
    assert up_to_date, "run  python tools/generate_parameters.py"


def test_the_page_of_parameters_gives_unit_default_and_source() -> None:
    lines = PARAMETERS["page"]().splitlines()
    assert "| `--max-distance` | m | 0.04 | 0.0001 to 1 | Largest distance of a correspondence |  |" in lines
    assert any(line.startswith("| `--recovery.proposals` \\* |") for line in lines)
    assert any("Oikonomidis et al. 2011, Sec. 2.3" in line for line in lines)


@PAGES
def test_links_lead_to_files(path: Path) -> None:
    links = re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", path.read_text(encoding="utf-8"))
    assert [link for link in links if not (path.parent / link).exists()] == []


@CURRENT
def test_options_exist(path: Path) -> None:
    named = re.findall(r"(?<![\w-])--([a-z][a-z0-9.-]*[a-z0-9])", path.read_text(encoding="utf-8"))
    assert set(named) - command_line_options() == set()


@CURRENT
def test_files_exist(path: Path) -> None:
    """Paths of modules and folders in code spans, from the root or from the package."""
    spans = re.findall(r"`([a-z_]+(?:/[a-z_]+)*(?:/|\.py))`", path.read_text(encoding="utf-8"))
    made = {"depth/", "rgb/", "hand_mask/", "exact_depth/"}
    places = [ROOT, ROOT / "depthtrack", *(each for each in (ROOT / "depthtrack").iterdir() if each.is_dir())]
    found = {span for span in spans if any((place / span).exists() for place in places)}
    assert set(spans) - made - found == set()


def test_contributing_names_what_the_files_hold() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"((?:`\w+`(?: and |, )?)+) in `([\w/]+\.py)`", text)
    assert len(named) >= 8
    for names, file in named:
        (path,) = (place / file for place in (ROOT, ROOT / "depthtrack") if (place / file).exists())
        source = path.read_text(encoding="utf-8")
        assert [name for name in re.findall(r"`(\w+)`", names) if not re.search(rf"\b{name}\b", source)] == []


def test_architecture_lists_the_packages_in_import_order() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ((?:`\w+`(?:, )?)+) \|", text, re.MULTILINE)
    assert [tuple(re.findall(r"`(\w+)`", row)) for row in rows] == list(LAYERS)


def test_citation_and_changelog_state_the_version() -> None:
    citation, changelog = ((ROOT / name).read_text(encoding="utf-8") for name in ("CITATION.cff", "CHANGELOG.md"))
    assert f"\nversion: {__version__}\n" in citation
    assert f"\n## [{__version__}] - " in changelog


def test_figures_of_readme_are_those_of_the_benchmarks() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (table,) = re.findall(r"^\| what \| the papers .*\n((?:\|.*\n)+)", text, re.MULTILINE)
    named, known = (
        set(re.findall(r"\d+(?:\.\d+)?", part))
        for part in (table, (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8"))
    )
    assert len(table.splitlines()) == 1 + 6
    assert named - known == set()


@PAGES
def test_python_is_valid(path: Path) -> None:
    import depthtrack

    for block in re.findall(r"```python\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL):
        compile(block, str(path), "exec")
        assert [name for name in re.findall(r"\bdepthtrack\.(\w+)", block) if not hasattr(depthtrack, name)] == []
