"""Print the lowest stated version of each dependency, for a second test environment.

    python tools/minimum_requirements.py test gltf > minimum.txt

Reads `pyproject.toml`: the core dependencies and those of the named extras. `name>=x` becomes `name==x`.
"""

import re
import sys
import tomllib
from pathlib import Path

PYPROJECT = Path(__file__).parents[1] / "pyproject.toml"
_REQUIREMENT = re.compile(r"(?P<name>[\w.-]+(?:\[[\w,.-]+\])?)\s*(?:>=\s*(?P<lowest>[\w.]+))?[^;]*(?P<marker>;.*)?")


def lowest(requirement: str) -> str:
    """Return a requirement pinned to its lowest version, unchanged if it has no lower bound.

    Raises:
        ValueError: the text is no requirement.
    """
    match = _REQUIREMENT.fullmatch(requirement.strip())
    if match is None:
        raise ValueError(f"expected a requirement such as 'name>=1.2', found {requirement!r}")
    if match["lowest"] is None:
        return requirement.strip()
    return f"{match['name']}=={match['lowest']}{match['marker'] or ''}"


def requirements(extras: list[str], pyproject: Path = PYPROJECT) -> list[str]:
    """Return the pinned requirements of the core and of the named extras.

    Raises:
        KeyError: an extra is not in `pyproject.toml`.
    """
    project = tomllib.loads(pyproject.read_text(encoding="utf-8"))["project"]
    stated = [*project["dependencies"], *(r for extra in extras for r in project["optional-dependencies"][extra])]
    return [lowest(requirement) for requirement in stated]


if __name__ == "__main__":
    print("\n".join(requirements(sys.argv[1:])))
