"""Backends by name, each imported at its first use."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.options import Objective
from depthtrack.rendering.scorer import Scorer


@dataclass(frozen=True)
class BackendEntry:
    """Module and class of a backend, its options, and the fixed options that select it."""

    module: str
    scorer: str
    options: tuple[str, ...] = ()
    fixed: Mapping[str, Any] = field(default_factory=dict)


_OPENGL = "depthtrack.rendering.opengl.scorer"
BACKENDS: dict[str, BackendEntry] = {
    "raster": BackendEntry("depthtrack.rendering.raster", "RasterScorer", ("threads",)),
    "egl": BackendEntry(_OPENGL, "OpenGLScorer", ("sums", "device"), {"platform": "egl"}),
    "osmesa": BackendEntry(_OPENGL, "OpenGLScorer", ("sums",), {"platform": "osmesa"}),
    "oracle": BackendEntry("depthtrack.rendering.oracle", "OracleScorer"),
}
"""The default first; `oracle` is the slow reference."""


def create_scorer(name: str, shape: HandShape, objective: Objective | None = None, **options: Any) -> Scorer:
    """Return a scorer of the named backend; `options` are those of its class.

    Raises:
        InputError: if the name or an option does not exist.
        DepthtrackError: if the backend lacks a system library; it names the package to install.
    """
    if name not in BACKENDS:
        raise InputError(f"no renderer '{name}': choose one of {', '.join(BACKENDS)}")
    entry = BACKENDS[name]
    for option in options:
        if option not in entry.options:
            known = ", ".join(entry.options) or "none"
            raise InputError(f"renderer '{name}' has no option '{option}': its options are {known}")
    scorer: Scorer = getattr(import_module(entry.module), entry.scorer)(shape, objective, **entry.fixed, **options)
    return scorer
