"""Hand sizes: the JSON file, its checks, and published anthropometry."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape

REST = make_pose(np.zeros(3), [1, 0, 0, 0], np.zeros(20))


@given(scale=st.floats(0.5, 2), seed=st.integers(0, 2**32 - 1), left=st.booleans())
def test_json_round_trip(tmp_path_factory: pytest.TempPathFactory, scale: float, seed: int, left: bool) -> None:
    rng = np.random.default_rng(seed)
    default = HandShape()
    shape = default.with_(
        side="left" if left else "right",
        scale=scale,
        lengths=np.round(default.lengths * rng.uniform(0.8, 1.2, (5, 3)), 6),
    )
    path = tmp_path_factory.mktemp("hand") / "hand.json"
    path.write_text(shape.to_json())
    assert HandShape.from_json(path) == shape
    np.testing.assert_allclose(HandShape.from_json(path).lengths, shape.lengths, rtol=0, atol=1e-12)


def test_sizes_agree_with_published_anthropometry() -> None:
    """Adult means of both sexes within 5 %: length 183 mm, knuckle breadth 84 mm (Greiner 1991)."""
    points = HandModel(HandShape()).keypoints(REST)
    assert np.linalg.norm(points[12] - points[0]) == pytest.approx(0.183, rel=0.05)
    shape = HandShape()
    breadth = shape.bases[1, 0] - shape.bases[4, 0] + shape.radii[1, 0] + shape.radii[4, 0]
    assert breadth == pytest.approx(0.084, rel=0.08)


@given(scale=st.floats(0.5, 2))
def test_scale_multiplies_every_distance(scale: float) -> None:
    unit, scaled = (HandModel(HandShape(scale=s)).keypoints(REST) for s in (1.0, scale))
    np.testing.assert_allclose(scaled, unit * scale, atol=1e-12)


def test_limits_are_ranges_that_hold_the_rest_pose() -> None:
    assert LOWER.shape == UPPER.shape == (20,)
    assert np.all(LOWER <= 0)
    assert np.all(UPPER > 0)
    assert UPPER.max() < np.radians(125)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"side": "middle"}, "side must be"),
        ({"scale": 40}, "scale must lie"),
        ({"palm": {}}, "missing"),
        ({"fingers": {}}, "missing"),
        ({"fingers": None}, "cannot read"),
        ({"scale": "wide"}, "cannot read"),
    ],
)
def test_bad_files_are_rejected_by_name(tmp_path: Path, change: dict[str, object], message: str) -> None:
    fields = {**json.loads(HandShape().to_json()), **change}
    path = tmp_path / "hand.json"
    path.write_text(json.dumps(fields))
    with pytest.raises(InputError, match=message) as caught:
        HandShape.from_json(path)
    assert "hand.json" in str(caught.value)


def test_metres_instead_of_millimetres_are_rejected(tmp_path: Path) -> None:
    fields = json.loads(HandShape().to_json())
    for finger in fields["fingers"].values():
        finger["lengths_mm"] = [x / 1000 for x in finger["lengths_mm"]]
    path = tmp_path / "hand.json"
    path.write_text(json.dumps(fields))
    with pytest.raises(InputError, match="millimetres"):
        HandShape.from_json(path)
