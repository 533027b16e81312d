"""The registry creates backends by name and rejects unknown names and options."""

import numpy as np
import pytest

from depthtrack.errors import DepthtrackError, InputError
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.backends import BACKENDS, create_scorer
from depthtrack.rendering.options import Objective
from depthtrack.rendering.selfcheck import scene


@pytest.mark.parametrize("name", BACKENDS)
def test_every_backend_is_created_by_name(name: str) -> None:
    shape, target, poses = scene()
    try:
        scorer = create_scorer(name, shape, Objective(silhouette_weight=5.0))
    except DepthtrackError as error:
        # One platform a process: whichever OpenGL the other tests use.
        assert name in ("egl", "osmesa")
        pytest.skip(str(error))
    with scorer:
        scorer.set_target(target)
        terms = scorer.terms(poses[:3])
    assert scorer.name == name
    np.testing.assert_allclose(terms.energy, terms.depth + 5 * terms.silhouette + 10 * terms.kinematic)


def test_an_unknown_name_lists_the_backends() -> None:
    with pytest.raises(InputError, match="no renderer 'cuda': choose one of raster, egl, osmesa, oracle"):
        create_scorer("cuda", HandShape())


def test_an_unknown_option_lists_the_options() -> None:
    with pytest.raises(InputError, match="'egl' has no option 'threads': its options are sums, device"):
        create_scorer("egl", HandShape(), threads=2)
    with pytest.raises(InputError, match="'oracle' has no option 'platform': its options are none"):
        create_scorer("oracle", HandShape(), platform="egl")
