"""`import depthtrack` loads nothing until a name is used, and every name is found."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import depthtrack

SOURCE = Path(depthtrack.__file__)
HEAVY = ("numpy", "scipy", "numba", "cv2", "matplotlib", "joblib", "depthtrack.api", "depthtrack.hand")


def names_for_type_checkers() -> set[tuple[str, str]]:
    """Return module and name of each import under TYPE_CHECKING."""
    tree = ast.parse(SOURCE.read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    imports = (node for node in block.body if isinstance(node, ast.ImportFrom))
    return {(str(each.module), alias.name) for each in imports for alias in each.names}


def test_the_import_loads_neither_numpy_nor_any_part_of_the_package() -> None:
    code = f"import sys, depthtrack; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", depthtrack.__all__)
def test_every_public_name_is_found_and_documented(name: str) -> None:
    assert getattr(depthtrack, name) is getattr(depthtrack, name)
    assert name in dir(depthtrack)
    if callable(value := getattr(depthtrack, name)):
        assert value.__doc__


def test_type_checkers_see_the_same_names() -> None:
    homes = {(f"depthtrack.{module}", name) for module, names in depthtrack._MODULES.items() for name in names}
    assert homes == names_for_type_checkers()


def test_no_public_name_is_a_subpackage() -> None:
    """The import of a subpackage would replace the name."""
    inside = {path.stem for path in SOURCE.parent.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
    assert not inside & set(depthtrack.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'magic'"):
        _ = depthtrack.magic
