"""Test the list of lowest versions, which continuous integration installs."""

import runpy
from pathlib import Path

import pytest

SCRIPT = runpy.run_path(str(Path(__file__).parents[1] / "tools" / "minimum_requirements.py"))


@pytest.mark.parametrize(
    ("stated", "lowest"),
    [
        ("numba>=0.61,<0.69", "numba==0.61"),
        ("dask[distributed]>=2024.8", "dask[distributed]==2024.8"),
        ("embreex>=4.4; platform_machine == 'x86_64'", "embreex==4.4; platform_machine == 'x86_64'"),
        ("scipy-stubs", "scipy-stubs"),
    ],
)
def test_lower_bounds_become_versions(stated: str, lowest: str) -> None:
    assert SCRIPT["lowest"](stated) == lowest


def test_text_without_requirement_is_rejected() -> None:
    with pytest.raises(ValueError, match="expected a requirement"):
        SCRIPT["lowest"](">= 3")


def test_every_core_dependency_has_a_lower_bound() -> None:
    assert all("==" in requirement for requirement in SCRIPT["requirements"]([]))
