"""Images of the primitives as polynomials of the pixel.

A ray (dx, dy, 1) / w meets a quadric at C w^2 + 2 B w + A = 0, with w the inverse depth. C does not depend on the
pixel, B is linear and A quadratic in it. So the face visible from outside is w = beta + sigma sqrt(D), with
beta = -B / C linear, D = beta^2 - A / C quadratic, and sigma the sign of C.
Everything is computed in float64, a lane a primitive.
"""

from depthtrack.rendering.raster import hand_constants as constants
from depthtrack.rendering.raster import tiles
from depthtrack.rendering.rendered_surface import NEAR
from depthtrack.simd.functions import narrow, vabs, vfloor, vsqrt
from depthtrack.simd.vectors import F64X8, either, filler, kernel_part, loader, select, store, vmax, vmin
from depthtrack.types import Array32

_load = loader(F64X8)
_fill = filler(F64X8)

SLOTS = constants.SLOTS
# Rows of the coefficient table, SLOTS entries each. Pixel offsets (u, v) count from the first pixel of the tile at
# column LEFT and row TOP. D is stored divided by four, which saves the kernel a halving.
BETA, BETA_U, BETA_V = 0, 1, 2
D, D_U, D_V, D_UU, D_UV, D_VV = 3, 4, 5, 6, 7, 8
SIGMA = 9
AXIS, AXIS_U, AXIS_V, AXIS_LOW, AXIS_HIGH = 10, 11, 12, 13, 14
LEFT, RIGHT, TOP, BOTTOM = 15, 16, 17, 18
HALF, AXIS_NEAR, AXIS_FAR, ROWS_PER_AXIS = 19, 20, 21, 22
COEFFICIENT_ROWS = 23

STEEP = 1e20
"""Factor on the axis coefficients. The two conditions >= 0 then exceed any w just inside the segment, and are far below
0 outside. So their minimum with w is w inside the segment, and negative elsewhere."""


@kernel_part
def _put(table: Array32, at: int, value) -> None:
    """Write eight lanes to a row from a slot on.

    at: row * SLOTS + slot. Given apart, each constant row would be compiled anew.
    """
    store(table, at, narrow(value))


@kernel_part
def _bound(focal, principal, size, c, cz, s_cc, s_cz, s_zz):
    """Return the pixels (low, high) that an ellipsoid spans along one image axis.

    The bounds are the two tangent planes through the optical centre. c, cz: centre, metres, along the image axis and
    the optical axis; s_..: entries of R diag(radii^2) R^T, metres^2; size: pixels of the image along the axis.
    """
    a = cz * cz - s_zz
    b = c * cz - s_cz
    root = vsqrt(vmax(b * b - a * (c * c - s_cc), 0.0))
    low = vmax(vfloor((b - root) / a * focal + principal), 0.0)
    high = vmin(vfloor((b + root) / a * focal + principal) + 1.0, size - 1.0)
    # An ellipsoid that crosses the plane z = 0 has no tangent planes and no bound; one behind it is invisible.
    has_tangents = a > 0.0
    low, high = select(has_tangents, low, 0.0), select(has_tangents, high, size - 1.0)
    is_visible = select(has_tangents, cz, 1.0) > 0.0
    return select(is_visible, low, 0.0), select(is_visible, high, -1.0)


@kernel_part
def span(size, low_a, high_a, za, low_b, high_b, zb):
    """Return the pixels (low, high) of two ends together; all if z = 0 is between them."""
    across = za * zb < 0.0
    low, high = vmin(low_a, low_b), vmax(high_a, high_b)
    return select(across, 0.0, low), select(across, size - 1.0, high)


@kernel_part
def _write(table, slot, camera, bounds, q, G, C):
    """Write the coefficients of A = d^T G d, -B = d.q, C; return their origin, a pixel (u, v).

    bounds: (u_low, u_high, v_low, v_high), pixels; G: symmetric, as (xx, yy, zz, xy, xz, yz).
    C vanishes if the optical centre lies on the surface; a floor avoids the division by zero.
    """
    ex, ey = camera[4], camera[5]
    left, right = vfloor(bounds[0] * (1 / tiles.TILE_WIDTH)), vfloor(bounds[1] * (1 / tiles.TILE_WIDTH))
    top, bottom = vfloor(bounds[2] * (1 / tiles.TILE_HEIGHT)), vfloor(bounds[3] * (1 / tiles.TILE_HEIGHT))
    u, v = left * tiles.TILE_WIDTH, top * tiles.TILE_HEIGHT
    xx, yy, zz, xy, xz, yz = G
    dx, dy = (u - camera[2]) * ex, (v - camera[3]) * ey
    i = 1.0 / select(vabs(C) > 1e-12, C, 1e-12)
    beta, beta_u, beta_v = (dx * q[0] + dy * q[1] + q[2]) * i, q[0] * i * ex, q[1] * i * ey
    gx, gy, gz = xx * dx + xy * dy + xz, xy * dx + yy * dy + yz, xz * dx + yz * dy + zz
    _put(table, BETA * SLOTS + slot, beta)
    _put(table, BETA_U * SLOTS + slot, beta_u)
    _put(table, BETA_V * SLOTS + slot, beta_v)
    d_vv = beta_v * beta_v - yy * i * (ey * ey)
    _put(table, D * SLOTS + slot, 0.25 * (beta * beta - (gx * dx + gy * dy + gz) * i))
    _put(table, D_U * SLOTS + slot, 0.5 * (beta * beta_u - gx * i * ex))
    _put(table, D_V * SLOTS + slot, 0.5 * (beta * beta_v - gy * i * ey))
    _put(table, D_UU * SLOTS + slot, 0.25 * (beta_u * beta_u - xx * i * (ex * ex)))
    _put(table, D_UV * SLOTS + slot, 0.5 * (beta_u * beta_v - xy * i * (ex * ey)))
    _put(table, D_VV * SLOTS + slot, 0.25 * d_vv)
    _put(table, HALF * SLOTS + slot, -2.0 / d_vv)
    _put(table, SIGMA * SLOTS + slot, select(C > 0.0, _fill(1.0), -1.0))
    _put(table, LEFT * SLOTS + slot, left)
    _put(table, RIGHT * SLOTS + slot, right)
    _put(table, TOP * SLOTS + slot, top)
    _put(table, BOTTOM * SLOTS + slot, bottom)
    return u, v


@kernel_part
def _write_segment(table, slot, camera, pixel, a, low, length, z, end_z, radius):
    """Write the segment on axis `a`: e - low w >= 0 and high w - e >= 0, with e = d.a.

    The depths z and end_z of its ends and `radius`, the reach of the surface around them, bound w. These bounds give
    AXIS_NEAR and AXIS_FAR: e lies between them wherever the segment is visible.
    """
    dx, dy = (pixel[0] - camera[2]) * camera[4], (pixel[1] - camera[3]) * camera[5]
    e_v, high = a[1] * camera[5], low + length
    w_high = 1.0 / vmax(vmin(z, end_z) - radius, NEAR)
    w_low = 1.0 / vmax(vmax(z, end_z) + radius, NEAR)
    _put(table, AXIS * SLOTS + slot, STEEP * (dx * a[0] + dy * a[1] + a[2]))
    _put(table, AXIS_U * SLOTS + slot, STEEP * (a[0] * camera[4]))
    _put(table, AXIS_V * SLOTS + slot, STEEP * e_v)
    _put(table, AXIS_LOW * SLOTS + slot, STEEP * low)
    _put(table, AXIS_HIGH * SLOTS + slot, STEEP * high)
    _put(table, AXIS_NEAR * SLOTS + slot, STEEP * vmin(low * w_low, low * w_high))
    _put(table, AXIS_FAR * SLOTS + slot, STEEP * vmax(high * w_low, high * w_high))
    _put(table, ROWS_PER_AXIS * SLOTS + slot, (1 / STEEP) / select(vabs(e_v) > 1e-12, e_v, 1e-12))


@kernel_part
def write_cones(table, k, hand, camera, bounds, p, a):
    """Write the cones of phalanx k from joints `p`, metres, camera frame, along unit axes `a`.

    A cone is |x - p|^2 - s^2 = (r - slope s)^2 with s = (x - p).a.
    """
    slope, radius = _load(hand, 8 * (constants.CONE_SLOPE + k)), _load(hand, 8 * (constants.CONE_RADIUS + k))
    length = _load(hand, 8 * (constants.CONE_LENGTH + k))
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
    slot = constants.CONES + 8 * k
    pixel = _write(table, slot, camera, bounds, q, G, C)
    widest = vmax(radius, radius - slope * length)
    _write_segment(table, slot, camera, pixel, a, m, length, p[2], p[2] + length * a[2], widest)


@kernel_part
def write_general(table, hand, camera, scratch, x, y, z, p):
    """Write the palm cylinder, its caps and the thumb's ellipsoid, a lane each.

    x, y, z: axes of their bodies, unit, camera frame.
    p: origins of their bodies, metres, camera frame.
    """
    c0, c1, c2 = (
        _load(hand, 8 * constants.GENERAL_CENTRE),
        _load(hand, 8 * constants.GENERAL_CENTRE + 8),
        _load(hand, 8 * constants.GENERAL_CENTRE + 16),
    )
    p = (
        x[0] * c0 + y[0] * c1 + z[0] * c2 + p[0],
        x[1] * c0 + y[1] * c1 + z[1] * c2 + p[1],
        x[2] * c0 + y[2] * c1 + z[2] * c2 + p[2],
    )
    s0, s1, s2 = (
        _load(hand, 8 * constants.GENERAL_SQUARE),
        _load(hand, 8 * constants.GENERAL_SQUARE + 8),
        _load(hand, 8 * constants.GENERAL_SQUARE + 16),
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
    # Lane 0, the cylinder, spans its two end discs (lanes 4 and 5).
    store(scratch, 0, p[2])
    across = scratch[4] * scratch[5] < 0.0
    u_low, v_low = (
        _first_from_discs(scratch, u_low, across, 0.0, True),
        _first_from_discs(scratch, v_low, across, 0.0, True),
    )
    u_high = _first_from_discs(scratch, u_high, across, camera[6] - 1.0, False)
    v_high = _first_from_discs(scratch, v_high, across, camera[7] - 1.0, False)

    i0, i1, i2 = (
        _load(hand, 8 * constants.GENERAL_INVERSE),
        _load(hand, 8 * constants.GENERAL_INVERSE + 8),
        _load(hand, 8 * constants.GENERAL_INVERSE + 16),
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
    low, length = y[0] * p[0] + y[1] * p[1] + y[2] * p[2], _load(hand, 8 * constants.GENERAL_LENGTH)
    # An ellipsoid around the optical centre is invisible; an open cylinder around it may be visible.
    u_high = select(either(C > 0.0, length > 0.0), u_high, -1.0)
    pixel = _write(table, constants.GENERAL, camera, (u_low, u_high, v_low, v_high), q, G, C)
    _write_segment(table, constants.GENERAL, camera, pixel, y, low, length, p[2], p[2] + length * y[2], vsqrt(S_zz))


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
    """Write spheres k of all fingers at `p`, metres, camera frame; return their pixel bounds."""
    radius = _load(hand, 8 * (constants.SPHERE_RADIUS + k))
    square, zero, one = radius * radius, _fill(0.0), _fill(1.0)
    u_low, u_high = _bound(camera[0], camera[2], camera[6], p[0], p[2], square, zero, square)
    v_low, v_high = _bound(camera[1], camera[3], camera[7], p[1], p[2], square, zero, square)
    C = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - square
    # A sphere around the optical centre is invisible.
    bounds = (u_low, select(C > 0.0, u_high, -1.0), v_low, v_high)
    _write(table, constants.SPHERES + 8 * k, camera, bounds, p, (one, one, one, zero, zero, zero), C)
    return u_low, u_high, v_low, v_high
