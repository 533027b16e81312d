"""The backends by name; none is imported before it is asked for."""

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
    """Where a backend lives, the options people may give it, and those that make it what it is."""

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
"""The default first; `oracle` is the slow truth the others are held to."""


def create_scorer(name: str, shape: HandShape, objective: Objective | None = None, **options: Any) -> Scorer:
    """A scorer of the named backend; `options` as its class documents them.

    Raises InputError for a name or an option that does not exist, and DepthtrackError, naming the package to
    install, where a backend lacks a system library.
    """
    if name not in BACKENDS:
        raise InputError(f"no renderer '{name}': choose one of {', '.join(BACKENDS)}")
    entry = BACKENDS[name]
    for option in options:
        if option not in entry.options:
            known = ", ".join(entry.options) or "no options"
            raise InputError(f"renderer '{name}' has no option '{option}': it knows {known}")
    scorer: Scorer = getattr(import_module(entry.module), entry.scorer)(shape, objective, **entry.fixed, **options)
    return scorer
