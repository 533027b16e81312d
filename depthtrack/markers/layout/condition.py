"""Condition numbers of eight symmetric matrices at once (Schroeder et al. 2015, Eq. 5).

Householder tridiagonalisation, then Laguerre's iteration for both extreme eigenvalues. From beyond all eigenvalues of a
symmetric matrix it converges to the nearest one, monotonically and cubically (Wilkinson, The Algebraic Eigenvalue
Problem, 1965, Ch. 7).

Each matrix is a lane of SIMD vectors. Element (i, j) of all eight is at 8 (i n + j) of an array (8 n n,), and only the
lower triangles are read.
"""

from depthtrack.simd.functions import vabs, vsqrt, vsum
from depthtrack.simd.vectors import F64X8, both, filler, kernel_part, loader, select, store, vmax, vmin
from depthtrack.types import Array

LANES = 8
LARGEST = 1e12
"""Condition number of a singular matrix."""
_STEP = 1e-6
"""Relative step after which the next would be below rounding."""
_ITERATIONS = 60
_load, _fill = loader(F64X8), filler(F64X8)


@kernel_part
def condition_numbers(A: Array, n: int, d: Array, e: Array, out: Array) -> None:
    """Write the ratios of the largest to the smallest eigenvalue to `out` (8,).

    They are at most `LARGEST`.

    A: (8 n n,) positive semidefinite matrices; they are overwritten.
    d, e: (8 n,) work space.
    """
    _tridiagonalise(A, n, d, e)
    total = _fill(0.0)
    for i in range(n):
        total = total + _load(d, LANES * i)
        off = _load(e, LANES * i)
        store(e, LANES * i, off * off)
    low, high = _nearest_eigenvalues(d, e, n, _fill(0.0), -1.0), _nearest_eigenvalues(d, e, n, total, 1.0)
    store(out, 0, _ratio(high, low))


@kernel_part
def least_conditions(A: Array, n: int, x: Array, out: Array) -> None:
    """Write lower bounds of `condition_numbers` to `out` (8,), at a fraction of its time.

    A: as there; it is overwritten. x: (8 n,) work space.

    The largest eigenvalue is at least each element of the diagonal. The smallest is at most the Rayleigh quotient of
    any vector: here that of one inverse iteration, with the triangular factors L D L^T of A.
    """
    high, low = _fill(0.0), _fill(1e300)
    for i in range(n):
        high = vmax(high, _load(A, LANES * (i * n + i)))
    for j in range(n):
        pivot = _load(A, LANES * (j * n + j))
        low = vmin(low, pivot)
        pivot = select(pivot > 0.0, pivot, 1.0)
        store(A, LANES * (j * n + j), pivot)
        inverse = 1.0 / pivot
        for i in range(j + 1, n):
            factor = _load(A, LANES * (i * n + j)) * inverse
            for k in range(j + 1, i + 1):
                at = LANES * (i * n + k)
                store(A, at, _load(A, at) - factor * _load(A, LANES * (k * n + j)))
        for i in range(j + 1, n):
            at = LANES * (i * n + j)
            store(A, at, _load(A, at) * inverse)
    # L^T x = e_n, then L D L^T y = x.
    store(x, LANES * (n - 1), _fill(1.0))
    for i in range(n - 2, -1, -1):
        total = _fill(0.0)
        for j in range(i + 1, n):
            total = total - _load(A, LANES * (j * n + i)) * _load(x, LANES * j)
        store(x, LANES * i, total)
    for i in range(n):
        total = _load(x, LANES * i)
        for j in range(i):
            total = total - _load(A, LANES * (i * n + j)) * _load(x, LANES * j)
        store(x, LANES * i, total)
    energy, square = _fill(0.0), _fill(0.0)
    for i in range(n - 1, -1, -1):
        z, pivot = _load(x, LANES * i), _load(A, LANES * (i * n + i))
        total = z / pivot
        energy = energy + z * total
        for j in range(i + 1, n):
            total = total - _load(A, LANES * (j * n + i)) * _load(x, LANES * j)
        store(x, LANES * i, total)
        square = square + total * total
    store(out, 0, _ratio(high, select(low > 0.0, vmin(low, energy / square), low)))


@kernel_part
def _ratio(high: Array, low: Array) -> Array:
    regular = low * LARGEST > high
    return select(regular, high / select(regular, low, 1.0), LARGEST)


@kernel_part
def _tridiagonalise(A: Array, n: int, d: Array, e: Array) -> None:
    """Write the diagonals to d and the subdiagonals to e from the second element on."""
    for i in range(n - 1, 0, -1):
        row, square = LANES * i * n, _fill(0.0)
        for k in range(i - 1):
            element = _load(A, row + LANES * k)
            square = square + element * element
        f = _load(A, row + LANES * (i - 1))
        store(d, LANES * i, _load(A, row + LANES * i))
        # A row that is tridiagonal already has no reflection.
        turns = square > 0.0
        square = square + f * f
        root = vsqrt(square)
        g = select(f > 0.0, _fill(0.0) - root, root)
        store(e, LANES * i, select(turns, g, f))
        if i == 1:
            continue
        # The Householder vector is row i with f - g in place of f; h is half its square.
        h = square - f * g
        inverse = select(turns, 1.0 / select(turns, h, 1.0), 0.0)
        store(A, row + LANES * (i - 1), f - g)
        dot = _fill(0.0)
        for j in range(i):
            total = _fill(0.0)
            for k in range(j + 1):
                total = total + _load(A, LANES * (j * n + k)) * _load(A, row + LANES * k)
            for k in range(j + 1, i):
                total = total + _load(A, LANES * (k * n + j)) * _load(A, row + LANES * k)
            total = total * inverse
            store(d, LANES * j, total)
            dot = dot + total * _load(A, row + LANES * j)
        half = 0.5 * dot * inverse
        for j in range(i):
            store(d, LANES * j, _load(d, LANES * j) - half * _load(A, row + LANES * j))
        for j in range(i):
            u, q = _load(A, row + LANES * j), _load(d, LANES * j)
            for k in range(j + 1):
                at = LANES * (j * n + k)
                store(A, at, _load(A, at) - (u * _load(d, LANES * k) + q * _load(A, row + LANES * k)))
    store(d, 0, _load(A, 0))
    store(e, 0, _fill(0.0))


@kernel_part
def _nearest_eigenvalues(d: Array, squares: Array, n: int, start: Array, side: float) -> Array:
    """Return the eigenvalues nearest to `start` of tridiagonal matrices.

    d: diagonals; squares: squared subdiagonals from the second element on.
    side: -1 if `start` is below all eigenvalues, 1 if above.
    """
    x, moving = start, _fill(1.0)
    for _ in range(_ITERATIONS):
        # The pivots of T - x, and the first two derivatives of the logarithm of its determinant.
        pivot = _load(d, 0) - x
        beyond = pivot * side < 0.0
        pivot = select(beyond, pivot, -side)
        slope = -1.0 / pivot
        curve, first, second = _fill(0.0), slope, slope * slope
        for i in range(1, n):
            t = _load(squares, LANES * i) / pivot
            pivot = _load(d, LANES * i) - x - t
            still = pivot * side < 0.0
            beyond = both(beyond, still)
            pivot = select(still, pivot, -side)
            inverse = 1.0 / pivot
            curve = t * (curve - 2.0 * slope * slope) * inverse
            slope = (t * slope - 1.0) * inverse
            first = first + slope
            second = second + slope * slope - curve
        root = vsqrt(vmax((n - 1.0) * (n * second - first * first), 0.0))
        # Lanes that are no longer beyond their eigenvalue have reached it.
        step = select(beyond, n * moving / (first + side * root), 0.0)
        x = x - step
        moving = select(_STEP * vabs(x) >= vabs(step), 0.0, moving)
        if vsum(moving) == 0.0:
            break
    return x
