"""Fits side by side give the bits of one after the other."""

from contextlib import closing
from functools import partial

import numpy as np
import pytest

from depthtrack.hand.pose import retract
from depthtrack.hand.shape import HandShape
from depthtrack.solver.icp import IcpFitter
from depthtrack.solver.options import IcpOptions, SurfaceName
from depthtrack.solver.parallel_fits import ParallelFits
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.surfaces.registry import make_surface
from depthtrack.types import Array
from tests.support.observations import observe

MADE = Synthesiser(Synthesis(model="skin", frames=6))


def fitter_and_starts(surface: SurfaceName = "skin") -> tuple[IcpFitter, Array]:
    fitter = IcpFitter(HandShape(), make_surface(surface, HandShape()), IcpOptions())
    fitter.set_target(observe(MADE, 2), 2)
    return fitter, retract(MADE[2].pose, np.random.default_rng(3).normal(0, 0.03, (7, 26)))


@pytest.mark.parametrize("surface", ["skin", "cylinders"])
@pytest.mark.parametrize("coarse", [False, True])
def test_the_number_of_threads_changes_no_bit(surface: SurfaceName, coarse: bool) -> None:
    fitter, starts = fitter_and_starts(surface)
    expected = [fitter.fit(start, coarse=coarse) for start in starts]
    fit = partial(IcpFitter.fit, coarse=coarse)
    for threads in (1, 2, 4):
        with closing(ParallelFits(threads)) as fits:
            for _ in range(3):
                np.testing.assert_array_equal(fits.fit_each(fitter, starts, fit), expected)


def test_twins_follow_their_fitter_to_another_target() -> None:
    fitter, starts = fitter_and_starts()
    with closing(ParallelFits(2)) as fits:
        fits.fit_each(fitter, starts, IcpFitter.fit)
        fitter.set_target(observe(MADE, 5), 2)
        expected = [fitter.fit(start) for start in starts]
        np.testing.assert_array_equal(fits.fit_each(fitter, starts, IcpFitter.fit), expected)


def test_the_poses_after_the_end_are_left_out() -> None:
    fitter, starts = fitter_and_starts()
    answers = iter([False, False, False, True, True, True, True])
    with closing(ParallelFits(2)) as fits:
        found = fits.fit_each(fitter, starts, IcpFitter.fit, lambda: next(answers))
    np.testing.assert_array_equal(found, [fitter.fit(start) for start in starts[:3]])


def test_an_error_of_a_fit_is_raised_after_all_threads_ended() -> None:
    fitter, starts = fitter_and_starts()

    def fail(own: IcpFitter, pose: Array) -> Array:
        raise ValueError("no fit")

    with closing(ParallelFits(2)) as fits:
        with pytest.raises(ValueError, match="no fit"):
            fits.fit_each(fitter, starts, fail)
        assert len(fits.fit_each(fitter, starts[:2], IcpFitter.fit)) == 2
