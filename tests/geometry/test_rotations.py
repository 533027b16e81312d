"""The numpy and the compiled functions fulfil the axioms of rotations and agree."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from depthtrack.geometry.rotations import (
    compiled_exp,
    compiled_log,
    compiled_matrix,
    compiled_normalised,
    compiled_product,
    normalised,
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_log,
    quaternion_product,
    rotation_matrix,
)

SEEDS = st.integers(0, 2**32 - 1)
ANGLES = st.one_of(
    st.floats(0, np.pi - 1e-3),
    st.sampled_from([0.0, 1e-300, 1e-160, 1e-12, 1e-9, 1.0001e-9, 1e-7, np.pi - 1e-4, np.pi - 1e-9]),
)


class Numpy:
    """Numpy functions of single quaternions."""

    product = staticmethod(quaternion_product)
    exp = staticmethod(quaternion_exp)
    log = staticmethod(quaternion_log)
    matrix = staticmethod(rotation_matrix)
    normalised = staticmethod(normalised)


class Compiled:
    """Compiled functions with the signatures of the numpy ones."""

    @staticmethod
    def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.array(compiled_product(*a, *b))

    @staticmethod
    def exp(vector: np.ndarray) -> np.ndarray:
        return np.array(compiled_exp(*vector))

    @staticmethod
    def log(quaternion: np.ndarray) -> np.ndarray:
        return np.array(compiled_log(*quaternion))

    @staticmethod
    def matrix(quaternion: np.ndarray) -> np.ndarray:
        out = np.empty((3, 4))
        compiled_matrix(*quaternion, out)
        return out[:, :3]

    @staticmethod
    def normalised(quaternion: np.ndarray) -> np.ndarray:
        return np.array(compiled_normalised(*quaternion))


Kind = type[Numpy] | type[Compiled]
KINDS = pytest.mark.parametrize("kind", [Numpy, Compiled])


def quaternions(seed: int, count: int) -> np.ndarray:
    """Return unit quaternions of either sign."""
    q = np.random.default_rng(seed).normal(size=(count, 4))
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


def direction(seed: int) -> np.ndarray:
    v = np.random.default_rng(seed).normal(size=3)
    return np.asarray(v / np.linalg.norm(v))


def scipy_rotation(q: np.ndarray) -> Rotation:
    return Rotation.from_quat(q[..., [1, 2, 3, 0]])


@KINDS
@given(seed=SEEDS)
def test_the_product_is_associative(kind: Kind, seed: int) -> None:
    a, b, c = quaternions(seed, 3)
    left, right = kind.product(kind.product(a, b), c), kind.product(a, kind.product(b, c))
    np.testing.assert_allclose(left, right, atol=1e-14)


@KINDS
@given(seed=SEEDS)
def test_the_conjugate_is_the_inverse_and_one_the_identity(kind: Kind, seed: int) -> None:
    (q,), one = quaternions(seed, 1), np.array([1.0, 0, 0, 0])
    conjugate = q * [1, -1, -1, -1]
    np.testing.assert_allclose(kind.product(q, conjugate), one, atol=1e-14)
    np.testing.assert_allclose(kind.product(conjugate, q), one, atol=1e-14)
    np.testing.assert_allclose(kind.product(one, q), q, atol=1e-15)
    np.testing.assert_allclose(kind.matrix(conjugate), kind.matrix(q).T, atol=1e-14)


@KINDS
@given(seed=SEEDS, length=st.floats(0.1, 10))
def test_the_matrix_is_a_homomorphism_into_rotations(kind: Kind, seed: int, length: float) -> None:
    a, b = quaternions(seed, 2)
    np.testing.assert_allclose(kind.matrix(kind.product(a, b)), kind.matrix(a) @ kind.matrix(b), atol=1e-14)
    np.testing.assert_allclose(kind.matrix(a) @ kind.matrix(a).T, np.eye(3), atol=1e-14)
    assert np.linalg.det(kind.matrix(a)) == pytest.approx(1, abs=1e-13)
    np.testing.assert_allclose(kind.matrix(length * a), scipy_rotation(a).as_matrix(), atol=1e-14)


@KINDS
@given(seed=SEEDS)
def test_both_quaternions_of_a_rotation_agree(kind: Kind, seed: int) -> None:
    (q,) = quaternions(seed, 1)
    np.testing.assert_array_equal(kind.matrix(q), kind.matrix(-q))
    np.testing.assert_array_equal(kind.normalised(q), kind.normalised(-q))
    assert kind.normalised(q)[0] >= 0
    np.testing.assert_allclose(kind.log(q), kind.log(-q), atol=1e-14)


@KINDS
@given(seed=SEEDS, angle=ANGLES)
def test_log_is_the_inverse_of_exp(kind: Kind, seed: int, angle: float) -> None:
    vector = angle * direction(seed)
    q = kind.exp(vector)
    assert np.linalg.norm(q) == pytest.approx(1, abs=1e-15)
    np.testing.assert_allclose(kind.log(q), vector, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(kind.exp(kind.log(q)), q, atol=1e-15)


@KINDS
@given(seed=SEEDS, angle=st.floats(0, 40))
def test_exp_agrees_with_scipy_and_log_takes_the_short_way(kind: Kind, seed: int, angle: float) -> None:
    vector = angle * direction(seed)
    expected = Rotation.from_rotvec(vector).as_matrix()
    np.testing.assert_allclose(kind.matrix(kind.exp(vector)), expected, atol=1e-13)
    short = kind.log(kind.exp(vector))
    assert np.linalg.norm(short) <= np.pi + 1e-12
    np.testing.assert_allclose(kind.matrix(kind.exp(short)), expected, atol=1e-13)


@KINDS
@given(seed=SEEDS, a=st.floats(-1.5, 1.5), b=st.floats(-1.5, 1.5))
def test_rotations_about_one_axis_add_up(kind: Kind, seed: int, a: float, b: float) -> None:
    axis = direction(seed)
    np.testing.assert_allclose(
        kind.product(kind.exp(a * axis), kind.exp(b * axis)), kind.exp((a + b) * axis), atol=1e-14
    )


@given(seed=SEEDS, angle=ANGLES)
def test_compiled_functions_agree_with_numpy(seed: int, angle: float) -> None:
    a, b = quaternions(seed, 2)
    vector = angle * direction(seed)
    np.testing.assert_allclose(Compiled.product(a, b), quaternion_product(a, b), atol=1e-15)
    np.testing.assert_allclose(Compiled.exp(vector), quaternion_exp(vector), rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(Compiled.log(a), quaternion_log(a), atol=1e-14)
    np.testing.assert_allclose(Compiled.matrix(a), rotation_matrix(a), atol=1e-15)
    np.testing.assert_allclose(Compiled.normalised(3 * a), normalised(3 * a), atol=1e-15)


@given(seed=SEEDS, angle=ANGLES)
def test_the_matrix_of_a_quaternion_gives_the_quaternion(seed: int, angle: float) -> None:
    for q in (normalised(quaternions(seed, 1)[0]), normalised(quaternion_exp(angle * direction(seed)))):
        back = quaternion_from_matrix(rotation_matrix(q))
        assert min(np.abs(back - q).max(), np.abs(back + q).max()) < 1e-7
        assert back[0] >= 0


@given(seed=SEEDS)
def test_functions_broadcast_over_leading_axes(seed: int) -> None:
    a, b = quaternions(seed, 6).reshape(2, 3, 4), quaternions(seed + 1, 3)
    product = quaternion_product(a, b)
    assert product.shape == (2, 3, 4)
    np.testing.assert_array_equal(product[1, 2], quaternion_product(a[1, 2], b[2]))
    expected = (scipy_rotation(a.reshape(6, 4)) * scipy_rotation(np.tile(b, (2, 1)))).as_matrix()
    np.testing.assert_allclose(rotation_matrix(product).reshape(6, 3, 3), expected, atol=1e-13)
    np.testing.assert_allclose(quaternion_log(quaternion_exp(a[..., 1:])), a[..., 1:], atol=1e-12)
