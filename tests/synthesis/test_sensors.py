"""Sensor models: errors match the published measurements in size and place."""

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.hand.primitives import SPHERE, ellipsoid
from depthtrack.rendering.raycast import raycast
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.synthesis.randomness import Stream, generator, normal_noise
from depthtrack.synthesis.sensors import SENSOR_NAMES, kinect1, kinect2, make_sensor, realsense
from depthtrack.synthesis.sensors.geometry import JUMP, edges, incidence, shadow
from depthtrack.synthesis.sensors.ideal import with_gaussian_noise
from depthtrack.types import Array

SMALL = Camera(160, 120, 525.0, 525.0, 79.5, 59.5)


def _facing(camera: Camera, depth: float | Array) -> RenderedSurface:
    surface = RenderedSurface.empty(camera)
    surface.depth[:] = depth
    surface.label[:] = 0
    surface.normal[..., 2] = -1
    return surface


def _tilted(camera: Camera, depth: float, degrees: float) -> RenderedSurface:
    """Return a plane through (0, 0, depth), rotated about the vertical axis."""
    normal = np.array([np.sin(np.radians(degrees)), 0, -np.cos(np.radians(degrees))])
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = camera.unproject(np.stack([u, v], axis=-1), np.ones(camera.shape))
    surface = _facing(camera, normal[2] * depth / (rays @ normal))
    surface.normal[:] = normal
    return surface


def _box_before_wall(camera: Camera, near: float, far: float, columns: slice) -> RenderedSurface:
    depth = np.full(camera.shape, far)
    depth[30:90, columns] = near
    return _facing(camera, depth)


def _rng(frame: int = 0) -> np.random.Generator:
    return generator(0, frame, Stream.DEPTH)


@pytest.mark.parametrize("name", SENSOR_NAMES)
def test_sensors_are_deterministic_and_do_not_modify_the_surface(name: str) -> None:
    sensor = make_sensor(name)
    surface = _tilted(sensor.camera, 1.0, 20)
    before = surface.depth.copy()
    first = sensor.read(surface, _rng())
    np.testing.assert_array_equal(first, sensor.read(surface, _rng()))
    np.testing.assert_array_equal(surface.depth, before)
    assert np.mean(first > 0) > 0.95
    assert abs(np.median((first - before)[first > 0])) < 0.001
    assert np.all(sensor.read(RenderedSurface.empty(sensor.camera), _rng()) == 0)


def test_the_error_for_an_unknown_sensor_lists_the_known_ones() -> None:
    with pytest.raises(InputError, match="ideal, kinect1, kinect2, realsense"):
        make_sensor("kinect3")


def test_the_ideal_sensor_reads_exact_depth_with_a_fine_scale() -> None:
    sensor = make_sensor("ideal")
    surface = _tilted(sensor.camera, 0.7, 30)
    np.testing.assert_array_equal(sensor.read(surface, _rng()), surface.depth)
    assert sensor.camera.depth_scale <= 0.0001


def test_gaussian_noise_has_the_given_deviation_and_adds_no_readings() -> None:
    depth = np.full((200, 300), 0.5)
    depth[:20] = 0
    noisy = with_gaussian_noise(depth, 0.005, _rng())
    assert np.all(noisy[:20] == 0)
    assert noisy[20:].std() == pytest.approx(0.005, rel=0.02)
    assert noisy[20:].mean() == pytest.approx(0.5, abs=1e-4)


def test_quantile_noise_is_normal() -> None:
    values = normal_noise(_rng(), (400, 500))
    assert values.mean() == pytest.approx(0, abs=0.01)
    assert values.std() == pytest.approx(1, abs=0.01)
    for bound, share in ((1, 0.6827), (2, 0.9545), (3, 0.9973)):
        assert np.mean(np.abs(values) < bound) == pytest.approx(share, abs=0.004)


@pytest.mark.parametrize("depth", [0.45, 0.6, 1.0, 2.0, 4.0])
def test_kinect1_axial_noise_matches_the_measurements(depth: float) -> None:
    read = kinect1.Kinect1(camera=SMALL).read(_facing(SMALL, depth), _rng())
    inner = read[5:-5, 5:-5]
    expected = 0.0012 + 0.0019 * (depth - 0.4) ** 2
    assert inner[inner > 0].std() == pytest.approx(expected, rel=0.05)
    assert inner[inner > 0].mean() == pytest.approx(depth, abs=0.1 * expected)


def test_kinect1_depth_comes_in_steps_of_an_eighth_of_a_pixel_of_disparity() -> None:
    read = kinect1.Kinect1(camera=SMALL).read(_tilted(SMALL, 1.5, 30), _rng())
    steps = 8 * 580 * 0.075 / read[read > 0]
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    # At 1.5 m a step is z^2 / (8 f b) = 6.5 mm, so the plane spans few steps.
    assert len(np.unique(np.round(steps))) < 60


def test_kinect1_noise_and_dropout_rise_at_grazing_incidence() -> None:
    assert kinect1.axial_noise(1.0, np.radians(80)) > 2 * kinect1.axial_noise(1.0, np.radians(50))
    sensor = kinect1.Kinect1(camera=SMALL)
    share = [np.mean(sensor.read(_tilted(SMALL, 1.0, angle), _rng()) > 0) for angle in (60, 76, 85)]
    assert share[0] > 0.95
    assert share[0] > share[1] > share[2]
    assert share[2] < 0.2


def test_kinect1_reads_from_40_centimetres_to_5_metres() -> None:
    sensor = kinect1.Kinect1(camera=SMALL)
    assert [bool(np.any(sensor.read(_facing(SMALL, z), _rng()))) for z in (0.3, 0.5, 4.5, 6.0)] == [0, 1, 1, 0]


def test_kinect1_lateral_noise_is_about_a_pixel() -> None:
    surface = _box_before_wall(SMALL, 0.8, 0.83, slice(60, 120))
    borders = []
    for frame in range(20):
        read = kinect1.Kinect1(camera=SMALL).read(surface, _rng(frame))[35:85]
        # The right border has no shadow: the last pixel of each row that reads the box.
        near = (read > 0) & (read < 0.815)
        borders.append(SMALL.width - 1 - np.argmax(near[:, ::-1], axis=1))
    assert 0.4 < np.std(borders) < 1.6
    assert np.mean(borders) == pytest.approx(119, abs=1.0)


@pytest.mark.parametrize("baseline", [0.05, 0.075])
def test_shadows_are_on_the_left_with_the_width_of_the_disparity_difference(baseline: float) -> None:
    near, far = 0.8, 1.1
    surface = _box_before_wall(SMALL, near, far, slice(80, 120))
    dark = shadow(surface.depth, SMALL, baseline)
    width = SMALL.fx * baseline * (1 / near - 1 / far)
    assert np.all(dark[30:90].sum(axis=1) == pytest.approx(width, abs=1.01))
    assert not dark[:29].any()
    assert not dark[:, 80:].any()
    np.testing.assert_array_equal(np.flatnonzero(dark[60])[-1], 79)


def test_the_shadow_of_a_thin_object_is_separate_from_it() -> None:
    surface = _box_before_wall(SMALL, 0.5, 1.5, slice(120, 130))
    dark = np.flatnonzero(shadow(surface.depth, SMALL, 0.075)[60])
    offset = SMALL.fx * 0.075 * (1 / 0.5 - 1 / 1.5)
    assert len(dark) == pytest.approx(10, abs=1)
    assert dark.mean() == pytest.approx(124.5 - offset, abs=1)


def test_a_shadow_is_where_the_second_camera_sees_something_nearer() -> None:
    rng = np.random.default_rng(5)
    camera, baseline = Camera(60, 40, 200.0, 200.0, 30.0, 20.0), 0.075
    depth = np.repeat(rng.choice([0.0, 0.6, 0.9, 1.5], (40, 12)), 5, axis=1) * rng.uniform(0.995, 1.005, (40, 60))
    near = np.zeros((40, 60))
    place = np.arange(60) - camera.fx * baseline / np.where(depth > 0, depth, np.inf)
    for v, u in np.argwhere(depth > 0):
        follows = u + 1 < 60 and abs(depth[v, u + 1] - depth[v, u]) <= JUMP * depth[v, u]
        ends = np.array([place[v, u], place[v, u + 1] if follows else place[v, u] + 1])
        inverse = 1 / np.array([depth[v, u], depth[v, u + 1] if follows else depth[v, u]])
        order = np.argsort(ends)
        for k in range(max(int(np.ceil(ends.min())), 0), min(int(np.floor(ends.max())), 59) + 1):
            near[v, k] = max(near[v, k], np.interp(k, ends[order], inverse[order]))
    expected = np.zeros((40, 60), dtype=bool)
    for v, u in np.argwhere(depth > 0):
        k = round(place[v, u])
        expected[v, u] = 0 <= k < 60 and near[v, k] > (1 + JUMP) / depth[v, u]
    assert expected.mean() > 0.05
    np.testing.assert_array_equal(shadow(depth, camera, baseline), expected)


def test_a_slanted_surface_casts_no_shadow_on_itself() -> None:
    assert not shadow(_tilted(SMALL, 0.8, 40).depth, SMALL, 0.075).any()
    assert not shadow(_tilted(SMALL, 0.8, -40).depth, SMALL, 0.075).any()


@pytest.mark.parametrize("depth", [0.6, 1.0, 2.0, 4.0])
def test_kinect2_axial_noise_matches_the_measurements(depth: float) -> None:
    read = kinect2.Kinect2(camera=SMALL).read(_facing(SMALL, depth), _rng())
    inner = read[5:-5, 5:-5]
    assert inner[inner > 0].std() == pytest.approx((1.5 - 0.5 * depth + 0.3 * depth**2) / 1000, rel=0.05)
    assert inner[inner > 0].mean() == pytest.approx(depth, abs=2e-4)


def test_kinect2_has_flying_pixels_only_at_silhouettes() -> None:
    surface = _box_before_wall(SMALL, 0.8, 1.6, slice(60, 120))
    read = kinect2.Kinect2(camera=SMALL).read(surface, _rng())
    flying = (read > 0.85) & (read < 1.55)
    assert flying.sum() > 30
    assert not np.any(flying & ~edges(surface.depth))
    # Half of the edge's pixels drop out.
    assert np.mean(read[edges(surface.depth)] == 0) == pytest.approx(0.5, abs=0.1)


def test_kinect2_has_no_readings_below_half_a_metre() -> None:
    assert not np.any(kinect2.Kinect2(camera=SMALL).read(_facing(SMALL, 0.45), _rng()))
    assert make_sensor("kinect2").default_distance > 0.6


@pytest.mark.parametrize("depth", [0.4, 0.8, 1.6])
def test_realsense_error_grows_with_the_square_of_the_distance(depth: float) -> None:
    sensor = realsense.RealSense()
    read = sensor.read(_facing(sensor.camera, depth), _rng())
    inner = read[10:-10, 60:-10]
    expected = depth**2 * 0.08 / (sensor.camera.fx * 0.05)
    assert inner[inner > 0].std() == pytest.approx(expected, rel=0.1)


def test_realsense_noise_is_correlated_within_a_matching_window_only() -> None:
    sensor = realsense.RealSense()
    error = sensor.read(_facing(sensor.camera, 1.0), _rng())[10:-10, 60:-10] - 1.0

    def correlation(shift: int) -> float:
        return float(np.corrcoef(error[:, shift:].ravel(), error[:, :-shift].ravel())[0, 1])

    assert correlation(1) > 0.8
    assert abs(correlation(12)) < 0.1


def test_realsense_fattens_the_foreground_and_has_a_shadow_on_its_left() -> None:
    sensor = realsense.RealSense()
    camera = sensor.camera
    depth = np.full(camera.shape, 1.5)
    depth[150:300, 300:400] = 0.6
    read = sensor.read(_facing(camera, depth), _rng())
    near = (read > 0) & (read < 0.7)
    grown = near & (depth > 1)
    assert 100 < grown.sum() < 2 * (2 * 150 + 2 * 100)
    v, u = np.nonzero(grown)
    assert v.min() >= 148
    assert u.max() <= 401
    width = camera.fx * 0.05 * (1 / 0.6 - 1 / 1.5)
    assert np.mean(read[160:290, 300 - int(width) + 3 : 297] == 0) > 0.99
    assert np.mean(read[160:290, 405:440] == 0) < 0.02


def test_realsense_is_limited_by_its_disparity_search() -> None:
    sensor = realsense.RealSense()
    assert sensor.nearest == pytest.approx(475 * 0.05 / 126)
    assert not np.any(sensor.read(_facing(sensor.camera, 0.17), _rng()))


def test_incidence_is_the_angle_between_normal_and_viewing_ray() -> None:
    centre, radius = np.array([0.02, -0.01, 0.6]), 0.08
    sphere = raycast(SMALL, np.array([SPHERE]), ellipsoid(tuple(centre), (radius,) * 3)[None], np.array([0]))
    theta = incidence(sphere, SMALL)
    assert np.all(theta[sphere.depth == 0] == np.pi / 2)
    v, u = np.nonzero(sphere.depth)
    points = SMALL.unproject(np.stack([u, v], axis=-1), sphere.depth[v, u])
    # A ray at distance d from the sphere's centre has an incidence of asin(d / r).
    along = points / np.linalg.norm(points, axis=-1, keepdims=True)
    miss = np.linalg.norm(np.cross(along, centre), axis=-1)
    np.testing.assert_allclose(theta[v, u], np.arcsin(np.minimum(miss / radius, 1)), atol=1e-6)


@pytest.mark.parametrize("shape", [(30, 40), (5, 3), (1, 1)])
@pytest.mark.parametrize("radius", [1, 2, 4])
def test_edges_are_pixels_with_a_neighbour_on_another_surface(shape: tuple[int, int], radius: int) -> None:
    rng = np.random.default_rng(5)
    depth = np.where(rng.random(shape) < 0.2, 0.0, 1.0 + 0.05 * (rng.random(shape) < 0.3))
    height, width = shape
    v, u = np.mgrid[:height, :width]
    steps = [step for step in range(-radius, radius + 1) if step]
    beside = [depth[v, np.clip(u + step, 0, width - 1)] for step in steps]
    beside += [depth[np.clip(v + step, 0, height - 1), u] for step in steps]
    expected = (depth > 0) & np.any([np.abs(other - depth) > JUMP * depth for other in beside], axis=0)
    np.testing.assert_array_equal(edges(depth, radius), expected)


def test_kinect1_reads_plain_pixels_like_the_others() -> None:
    surface, error = _tilted(SMALL, 1.0, 20), normal_noise(_rng(), SMALL.shape)
    lens, limits, nowhere = (SMALL.fx, SMALL.fy, SMALL.cx, SMALL.cy), (0.4, 5.0), np.zeros(SMALL.shape, np.bool_)
    out, plain = np.zeros(SMALL.shape), np.zeros(SMALL.width, np.bool_)
    kinect1._read(
        surface.depth,
        surface.normal,
        lens,
        nowhere,
        nowhere,
        (np.zeros((2, *SMALL.shape), np.uint8), np.zeros(256, np.float32)),
        error,
        np.full(SMALL.shape, 0xFFFFFFFF, np.uint32),
        limits,
        out,
    )
    scale = kinect1.STEPS * kinect1.INFRARED_FOCAL * kinect1.BASELINE
    sigma = np.vectorize(kinect1.axial_noise)(surface.depth, 0.0) * scale / surface.depth**2
    disparity = scale / surface.depth + np.sqrt(np.maximum(sigma**2 - 1 / 12, 0)) * error
    np.testing.assert_allclose(out, scale / np.rint(disparity), rtol=1e-12)
    row, x, y = np.empty(SMALL.width), (np.arange(SMALL.width) - SMALL.cx) / SMALL.fx, (3 - SMALL.cy) / SMALL.fy
    kinect1._read_plain(surface.depth[3], surface.normal[3], x, y, nowhere[3], nowhere[3], error[3], limits, plain, row)
    assert plain.all()
    np.testing.assert_array_equal(row, out[3])
