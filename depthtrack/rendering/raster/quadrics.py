"""What every primitive looks like in the image, as polynomials of the pixel.

A ray (dx, dy, 1) / w meets a quadric where C w^2 + 2 B w + A = 0, with w the inverse depth. C does not depend on the
pixel, B is linear and A quadratic in it, so the face seen from outside is w = beta + sigma sqrt(D), beta = -B / C
linear, D = beta^2 - A / C quadratic, sigma the sign of C. Everything is computed in float64, a lane a primitive.
"""

from depthtrack.rendering.raster import layout
from depthtrack.rendering.raster import tiles as tiles
from depthtrack.rendering.rendered_surface import NEAR
from depthtrack.simd.functions import narrow, vabs, vfloor, vsqrt
from depthtrack.simd.vectors import F64X8, either, filler, kernel_part, loader, select, store, vmax, vmin
from depthtrack.types import Array32

_load = loader(F64X8)
_fill = filler(F64X8)

SLOTS = layout.SLOTS
# Rows of the coefficient table: SLOTS entries each. Pixel offsets (u, v) count from the first pixel of block TOP of
# stripe LEFT. D is kept by the quarter, which saves the kernel a halving.
BETA, BETA_U, BETA_V = 0, 1, 2
D, D_U, D_V, D_UU, D_UV, D_VV = 3, 4, 5, 6, 7, 8
SIGMA = 9
AXIS, AXIS_U, AXIS_V, AXIS_LOW, AXIS_HIGH = 10, 11, 12, 13, 14
LEFT, RIGHT, TOP, BOTTOM = 15, 16, 17, 18
HALF, AXIS_NEAR, AXIS_FAR, ROWS_PER_AXIS = 19, 20, 21, 22
COEFFICIENT_ROWS = 23

STEEP = 1e20
"""Factor on all that concerns the axis. What is to be >= 0 is then above any w a hair inside the segment, and far below
0 outside: the least of it and w is w where the segment is, and nothing elsewhere."""


@kernel_part
def _put(table: Array32, row: int, slot: int, value) -> None:
    store(table, row * SLOTS + slot, narrow(value))


@kernel_part
def _bound(focal, principal, size, c, cz, s_cc, s_cz, s_zz):
    """Pixels (low, high) an ellipsoid spans along one image axis: the two planes through the lens that touch it.

    `c` and `cz` are its centre across and along the view, s_.. the entries of R diag(radii^2) R^T.
    """
    a = cz * cz - s_zz
    b = c * cz - s_cz
    root = vsqrt(vmax(b * b - a * (c * c - s_cc), 0.0))
    low = vmax(vfloor((b - root) / a * focal + principal), 0.0)
    high = vmin(vfloor((b + root) / a * focal + principal) + 1.0, size - 1.0)
    # What holds the lens' plane has no such planes and may be anywhere; what lies behind it is nowhere.
    touched = a > 0.0
    low, high = select(touched, low, 0.0), select(touched, high, size - 1.0)
    seen = select(touched, cz, 1.0) > 0.0
    return select(seen, low, 0.0), select(seen, high, -1.0)


@kernel_part
def span(size, low_a, high_a, za, low_b, high_b, zb):
    """Pixels spanned by two ends together: anywhere when the lens' plane lies between them."""
    across = za * zb < 0.0
    low, high = vmin(low_a, low_b), vmax(high_a, high_b)
    return select(across, 0.0, low), select(across, size - 1.0, high)


@kernel_part
def _write(table, slot, camera, bounds, q, G, C):
    """Coefficients of A = d^T G d, -B = d.q and C; returns the pixel (u, v) they count from.

    `bounds` (u_low, u_high, v_low, v_high) pixels; G symmetric as (xx, yy, zz, xy, xz, yz). A vanishing C would mean
    a lens on the surface; it is kept from dividing.
    """
    ex, ey = camera[4], camera[5]
    left, right = vfloor(bounds[0] * (1 / tiles.COLUMNS)), vfloor(bounds[1] * (1 / tiles.COLUMNS))
    top, bottom = vfloor(bounds[2] * (1 / tiles.ROWS)), vfloor(bounds[3] * (1 / tiles.ROWS))
    u, v = left * tiles.COLUMNS, top * tiles.ROWS
    xx, yy, zz, xy, xz, yz = G
    dx, dy = (u - camera[2]) * ex, (v - camera[3]) * ey
    i = 1.0 / select(vabs(C) > 1e-12, C, 1e-12)
    beta, beta_u, beta_v = (dx * q[0] + dy * q[1] + q[2]) * i, q[0] * i * ex, q[1] * i * ey
    gx, gy, gz = xx * dx + xy * dy + xz, xy * dx + yy * dy + yz, xz * dx + yz * dy + zz
    _put(table, BETA, slot, beta)
    _put(table, BETA_U, slot, beta_u)
    _put(table, BETA_V, slot, beta_v)
    d_vv = beta_v * beta_v - yy * i * (ey * ey)
    _put(table, D, slot, 0.25 * (beta * beta - (gx * dx + gy * dy + gz) * i))
    _put(table, D_U, slot, 0.5 * (beta * beta_u - gx * i * ex))
    _put(table, D_V, slot, 0.5 * (beta * beta_v - gy * i * ey))
    _put(table, D_UU, slot, 0.25 * (beta_u * beta_u - xx * i * (ex * ex)))
    _put(table, D_UV, slot, 0.5 * (beta_u * beta_v - xy * i * (ex * ey)))
    _put(table, D_VV, slot, 0.25 * d_vv)
    _put(table, HALF, slot, -2.0 / d_vv)
    _put(table, SIGMA, slot, select(C > 0.0, _fill(1.0), -1.0))
    _put(table, LEFT, slot, left)
    _put(table, RIGHT, slot, right)
    _put(table, TOP, slot, top)
    _put(table, BOTTOM, slot, bottom)
    return u, v


@kernel_part
def _write_segment(table, slot, camera, pixel, a, low, length, z, end_z, radius):
    """The part of an axis `a` that exists: e - low w >= 0 and high w - e >= 0, where e = d.a.

    From the depths of its ends and how far (`radius`) the surface reaches out of them follow bounds on w, and from
    these AXIS_NEAR and AXIS_FAR, between which e lies wherever the segment is seen.
    """
    dx, dy = (pixel[0] - camera[2]) * camera[4], (pixel[1] - camera[3]) * camera[5]
    e_v, high = a[1] * camera[5], low + length
    w_high = 1.0 / vmax(vmin(z, end_z) - radius, NEAR)
    w_low = 1.0 / vmax(vmax(z, end_z) + radius, NEAR)
    _put(table, AXIS, slot, STEEP * (dx * a[0] + dy * a[1] + a[2]))
    _put(table, AXIS_U, slot, STEEP * (a[0] * camera[4]))
    _put(table, AXIS_V, slot, STEEP * e_v)
    _put(table, AXIS_LOW, slot, STEEP * low)
    _put(table, AXIS_HIGH, slot, STEEP * high)
    _put(table, AXIS_NEAR, slot, STEEP * vmin(low * w_low, low * w_high))
    _put(table, AXIS_FAR, slot, STEEP * vmax(high * w_low, high * w_high))
    _put(table, ROWS_PER_AXIS, slot, (1 / STEEP) / select(vabs(e_v) > 1e-12, e_v, 1e-12))


@kernel_part
def write_cones(table, k, hand, camera, bounds, p, a):
    """Cones of phalanx k from joints `p` along unit axes `a`: |x - p|^2 - s^2 = (r - slope s)^2, s = (x - p).a."""
    slope, radius = _load(hand, 8 * (layout.CONE_SLOPE + k)), _load(hand, 8 * (layout.CONE_RADIUS + k))
    length = _load(hand, 8 * (layout.CONE_LENGTH + k))
    m = p[0] * a[0] + p[1] * a[1] + p[2] * a[2]
    g = radius + slope * m
    eta = m + slope * g
    C = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - m * m - g * g
    q = (p[0] - eta * a[0], p[1] - eta * a[1], p[2] - eta * a[2])
    w = slope * slope + 1.0
    G = (
        1.0 - w * a[0] * a[0],
        1.0 - w * a[1] * a[1],
        1.0 - w * a[2] * a[2],
        0.0 - w * a[0] * a[1],
        0.0 - w * a[0] * a[2],
        0.0 - w * a[1] * a[2],
    )
    slot = layout.CONES + 8 * k
    pixel = _write(table, slot, camera, bounds, q, G, C)
    widest = vmax(radius, radius - slope * length)
    _write_segment(table, slot, camera, pixel, a, m, length, p[2], p[2] + length * a[2], widest)


@kernel_part
def write_general(table, hand, camera, scratch, x, y, z, p):
    """Palm cylinder, caps and the thumb's ellipsoid: axes x, y, z and body positions p, a lane each."""
    c0, c1, c2 = (
        _load(hand, 8 * layout.GENERAL_CENTRE),
        _load(hand, 8 * layout.GENERAL_CENTRE + 8),
        _load(hand, 8 * layout.GENERAL_CENTRE + 16),
    )
    p = (
        x[0] * c0 + y[0] * c1 + z[0] * c2 + p[0],
        x[1] * c0 + y[1] * c1 + z[1] * c2 + p[1],
        x[2] * c0 + y[2] * c1 + z[2] * c2 + p[2],
    )
    s0, s1, s2 = (
        _load(hand, 8 * layout.GENERAL_SQUARE),
        _load(hand, 8 * layout.GENERAL_SQUARE + 8),
        _load(hand, 8 * layout.GENERAL_SQUARE + 16),
    )
    S_zz = s0 * x[2] * x[2] + s1 * y[2] * y[2] + s2 * z[2] * z[2]
    u_low, u_high = _bound(
        camera[0], camera[2], camera[6], p[0], p[2],
        s0 * x[0] * x[0] + s1 * y[0] * y[0] + s2 * z[0] * z[0],
        s0 * x[0] * x[2] + s1 * y[0] * y[2] + s2 * z[0] * z[2],
        S_zz,
    )  # fmt: skip
    v_low, v_high = _bound(
        camera[1], camera[3], camera[7], p[1], p[2],
        s0 * x[1] * x[1] + s1 * y[1] * y[1] + s2 * z[1] * z[1],
        s0 * x[1] * x[2] + s1 * y[1] * y[2] + s2 * z[1] * z[2],
        S_zz,
    )  # fmt: skip
    # Lane 0, the cylinder, spans what its two end discs (lanes 4 and 5) span.
    store(scratch, 0, p[2])
    across = scratch[4] * scratch[5] < 0.0
    u_low, v_low = (
        _first_from_discs(scratch, u_low, across, 0.0, True),
        _first_from_discs(scratch, v_low, across, 0.0, True),
    )
    u_high = _first_from_discs(scratch, u_high, across, camera[6] - 1.0, False)
    v_high = _first_from_discs(scratch, v_high, across, camera[7] - 1.0, False)

    i0, i1, i2 = (
        _load(hand, 8 * layout.GENERAL_INVERSE),
        _load(hand, 8 * layout.GENERAL_INVERSE + 8),
        _load(hand, 8 * layout.GENERAL_INVERSE + 16),
    )
    h0 = i0 * (x[0] * p[0] + x[1] * p[1] + x[2] * p[2])
    h1 = i1 * (y[0] * p[0] + y[1] * p[1] + y[2] * p[2])
    h2 = i2 * (z[0] * p[0] + z[1] * p[1] + z[2] * p[2])
    C = h0 * h0 + h1 * h1 + h2 * h2 - 1.0
    h0, h1, h2 = i0 * h0, i1 * h1, i2 * h2
    q = (h0 * x[0] + h1 * y[0] + h2 * z[0], h0 * x[1] + h1 * y[1] + h2 * z[1], h0 * x[2] + h1 * y[2] + h2 * z[2])
    i0, i1, i2 = i0 * i0, i1 * i1, i2 * i2
    G = (
        i0 * x[0] * x[0] + i1 * y[0] * y[0] + i2 * z[0] * z[0],
        i0 * x[1] * x[1] + i1 * y[1] * y[1] + i2 * z[1] * z[1],
        i0 * x[2] * x[2] + i1 * y[2] * y[2] + i2 * z[2] * z[2],
        i0 * x[0] * x[1] + i1 * y[0] * y[1] + i2 * z[0] * z[1],
        i0 * x[0] * x[2] + i1 * y[0] * y[2] + i2 * z[0] * z[2],
        i0 * x[1] * x[2] + i1 * y[1] * y[2] + i2 * z[1] * z[2],
    )
    low, length = y[0] * p[0] + y[1] * p[1] + y[2] * p[2], _load(hand, 8 * layout.GENERAL_LENGTH)
    # An ellipsoid that holds the lens shows nothing; a cylinder without ends may hold it and be seen.
    u_high = select(either(C > 0.0, length > 0.0), u_high, -1.0)
    pixel = _write(table, layout.GENERAL, camera, (u_low, u_high, v_low, v_high), q, G, C)
    _write_segment(table, layout.GENERAL, camera, pixel, y, low, length, p[2], p[2] + length * y[2], vsqrt(S_zz))


@kernel_part
def _first_from_discs(scratch, bound, across, anywhere, low):
    store(scratch, 0, bound)
    if across:
        scratch[0] = anywhere
    else:
        scratch[0] = min(scratch[4], scratch[5]) if low else max(scratch[4], scratch[5])
    return _load(scratch, 0)


@kernel_part
def write_spheres(table, k, hand, camera, p):
    """Spheres k of all fingers at `p`; returns their bounds."""
    radius = _load(hand, 8 * (layout.SPHERE_RADIUS + k))
    square, zero, one = radius * radius, _fill(0.0), _fill(1.0)
    u_low, u_high = _bound(camera[0], camera[2], camera[6], p[0], p[2], square, zero, square)
    v_low, v_high = _bound(camera[1], camera[3], camera[7], p[1], p[2], square, zero, square)
    C = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - square
    seen = (u_low, select(C > 0.0, u_high, -1.0), v_low, v_high)  # a sphere that holds the lens shows nothing
    _write(table, layout.SPHERES + 8 * k, camera, seen, p, (one, one, one, zero, zero, zero), C)
    return u_low, u_high, v_low, v_high
