"""The import rules of the architecture, checked on the imports that the source states."""

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = "depthtrack"

LAYERS = (
    ("closing", "errors", "number_text", "types"),
    ("ranges", "strict_data"),
    ("files", "options", "outputs", "resources", "text_table", "selection"),
    ("machine", "memory"),
    ("compilation",),
    ("ahead_analysis",),
    ("ahead_compiler",),
    ("kernel_list",),
    ("kernel_processes",),
    ("precompilation",),
    ("geometry",),
    ("simd",),
    ("hand",),
    ("recording",),
    ("export",),
    ("rendering",),
    ("segmentation",),
    ("solver",),
    ("tracking",),
    ("markers",),
    ("calibration",),
    ("posture_databases",),
    ("synthesis",),
    ("evaluation",),
    ("benchmarks",),
    ("viewing",),
    ("report",),
    ("api",),
    ("live",),
    ("cli",),
)
"""Packages and modules in import order. A layer imports from layers before it, never from its own or later ones."""

FORBIDDEN = (
    (("segmentation", "tracking", "markers", "solver"), ("synthesis", "evaluation")),
    (("solver",), ("rendering",)),
    (("tracking", "calibration"), ("rendering.raster", "rendering.opengl", "rendering.oracle")),
    (("evaluation",), ("tracking.stages", "tracking.proposals", "solver")),
)
"""Importers, and what they must not import, whatever the order of layers says."""


def modules() -> dict[str, Path]:
    """Return the path of every module of the package, by its dotted name without the package's."""
    found = {}
    for path in sorted((ROOT / PACKAGE).rglob("*.py")):
        parts = path.relative_to(ROOT / PACKAGE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


MODULES = modules()


def imports_of(path: Path) -> Iterator[str]:
    """Yield the modules of the package that a file imports anywhere, for type checks and inside functions too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports are not used"
            # `from package import name` imports the module `package.name` if there is one.
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            head, _, inner = name.partition(".")
            if head != PACKAGE:
                continue
            while inner and inner not in MODULES:
                inner = inner.rpartition(".")[0]
            if inner:
                yield inner


IMPORTS = {name: frozenset(imports_of(path)) - {name} for name, path in MODULES.items()}
RANK = {name: rank for rank, layer in enumerate(LAYERS) for name in layer}
ROOT_MODULES = ("", "__main__")
"""The public interface and the entry point, which import from every layer."""


def is_within(module: str, package: str) -> bool:
    return module == package or module.startswith(f"{package}.")


def violations() -> Iterator[tuple[str, str]]:
    for importer, imported in IMPORTS.items():
        if importer in ROOT_MODULES:
            continue
        top = importer.partition(".")[0]
        for other in imported:
            other_top = other.partition(".")[0]
            upward = top != other_top and RANK[other_top] >= RANK[top]
            forbidden = any(
                any(is_within(importer, one) for one in importers) and any(is_within(other, one) for one in targets)
                for importers, targets in FORBIDDEN
            )
            if upward or forbidden:
                yield importer, other


def test_every_module_has_a_layer() -> None:
    assert {name.partition(".")[0] for name in MODULES} - set(ROOT_MODULES) <= set(RANK)


def test_imports_follow_the_layers_and_rules() -> None:
    found = set(violations())
    assert not found, "these imports break a rule of the architecture"


def test_no_module_imports_itself_through_others() -> None:
    try:
        TopologicalSorter(IMPORTS).prepare()
    except CycleError as error:
        pytest.fail(f"modules import each other in a circle: {' -> '.join(error.args[1])}")


@pytest.mark.parametrize(
    ("importer", "imported"),
    [("solver.icp", "rendering.scorer"), ("evaluation.replay", "tracking.stages.predict"), ("hand.shape", "cli")],
)
def test_a_forbidden_import_is_found(monkeypatch: pytest.MonkeyPatch, importer: str, imported: str) -> None:
    monkeypatch.setitem(IMPORTS, importer, frozenset({imported}))
    assert (importer, imported) in set(violations())
