"""What each tracker alone can be told; given for the other one, it is refused."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import tyro

from depthtrack.errors import InputError


def _unless(metavar: str, default: str) -> Any:
    """An option whose value the tracker knows where it is not given."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint=f"(default: {default})")


@dataclass(frozen=True)
class PsoChoice:
    """With --tracker pso: a swarm of hypotheses, rendered and compared with what is seen."""

    particles: Annotated[int | None, _unless("INT", "64")] = None
    """Particles of the swarm."""
    generations: Annotated[int | None, _unless("INT", "25")] = None
    """Generations of the swarm, every frame."""
    resolution: Annotated[int | None, _unless("PIXELS", "the sensor's own")] = None
    """Longest side of the region that hypotheses are rendered at."""
    renderer: Annotated[
        Literal["raster", "egl", "osmesa", "oracle"] | None, _unless("raster|egl|osmesa|oracle", "raster")
    ] = None
    """What renders and scores the hypotheses."""
    finish: Annotated[Literal["none", "skin"] | None, _unless("none|skin", "none")] = None
    """Draw the swarm's pose to the observed points by the hand's skin, for hands that no cylinders look like."""
    threads: Annotated[int | None, _unless("N", "one for each core")] = None
    """Threads of the renderer. Poses do not depend on it."""


@dataclass(frozen=True)
class IkChoice:
    """With --tracker ik: the hand's surface, drawn to the observed points."""

    model: Annotated[Literal["skin", "cylinders"] | None, _unless("skin|cylinders", "skin")] = None
    """The surface: a skin mesh, or tapered cylinders with round ends."""
    residual: Annotated[
        Literal["point", "plane", "symmetric"] | None, _unless("point|plane|symmetric", "symmetric, point with paper")
    ] = None
    """What is to vanish: the distance of points, or its part along the surface's normals, or along both surfaces'."""
    rounds: Annotated[int | None, _unless("INT", "5")] = None
    """Rounds of correspondences, every frame."""
    inner: Annotated[int | None, _unless("INT", "5")] = None
    """Gauss-Newton steps in each round, at most."""
    subsample: Annotated[int | None, _unless("INT", "3")] = None
    """Every so many-th point is used."""
    synergies: Annotated[str | None, _unless("NAME|FILE.json", "all angles are free")] = None
    """Solve for hand synergies instead of angles: leap, leap-grasps, or a file of `depthtrack synergies fit`."""
    components: Annotated[int | None, _unless("INT", "all there are")] = None
    """Only the first so many of the synergies."""
    soft: tyro.conf.FlagCreatePairsOff[bool] = False
    """With --synergies: solve for all angles, drawn to postures that are likely by the synergies."""


def chosen_options(tracker: str, pso: PsoChoice, ik: IkChoice) -> dict[str, Any]:
    """The options given for `tracker`. Raises InputError where one was given that only the other has."""
    own, other = ("pso", "ik") if tracker == "pso" else ("ik", "pso")
    given = {name: _given(choice) for name, choice in (("pso", pso), ("ik", ik))}
    if given[other]:
        names = ", ".join(f"--{name}" for name in given[other])
        raise InputError(f"the tracker {own} has no {names}: leave that out, or choose --tracker {other}")
    return given[own]


def _given(choice: PsoChoice | IkChoice) -> dict[str, Any]:
    return {name: value for name, value in vars(choice).items() if value is not None and value is not False}
