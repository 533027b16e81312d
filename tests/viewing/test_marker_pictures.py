"""Pictures of labelled captures: dots where the markers are, names in view, equal bytes."""

from dataclasses import replace
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from depthtrack.viewing.marker_pictures import fullest_frame, model_view, scene_picture, whole_view
from depthtrack.viewing.marker_residuals import residual_png
from depthtrack.viewing.marker_scene import UNLABELLED_COLOUR, MarkerScene
from depthtrack.viewing.marker_video import write_marker_video
from depthtrack.viewing.text_placement import place_names
from tests.support.markers import RATE, labelled_hands


@pytest.fixture(scope="module")
def scene() -> MarkerScene:
    return MarkerScene.of(labelled_hands(sides=("right", "left")))


def test_a_dot_is_where_each_measured_marker_is(scene: MarkerScene) -> None:
    frame, view = 30, model_view(scene, 0, 30)
    image = scene.draw(frame, view)
    pixels = view.camera.project(view.points(scene.positions[0][frame]))
    expected = view.camera.project(view.points(scene.labelled.models[0].positions(scene.labelled.poses[0][frame])))
    measured = scene.labelled.columns[0][frame] >= 0
    assert 0 < measured.sum() < len(measured)
    for m, colour in enumerate(scene.colours(0)):
        x, y = (pixels if measured[m] else expected)[m].round().astype(int)
        here = image[y, x].astype(int)
        shades = [np.array(colour), 0.45 * np.array(colour)]
        near = min(float(np.abs(here - shade).max()) for shade in shades)
        assert (near < 40) == bool(measured[m]), f"marker {m}: a dot is full if the marker is measured, else a ring"


def test_points_without_a_label_are_crosses(scene: MarkerScene) -> None:
    seen = np.asarray(np.isfinite(scene.rest).all(axis=-1))
    with_ghost = int(np.flatnonzero(seen.any(axis=1))[0])
    view = whole_view(scene)
    ghost = scene.rest[with_ghost][np.isfinite(scene.rest[with_ghost]).all(axis=-1)][0]
    x, y = view.camera.project(view.points(ghost)).round().astype(int)
    if 4 <= x < view.camera.width - 4 and 4 <= y < view.camera.height - 4:
        patch = scene.draw(with_ghost, view)[y - 2 : y + 3, x - 2 : x + 3].reshape(-1, 3).astype(int)
        assert np.abs(patch - np.array(UNLABELLED_COLOUR)).max(axis=1).min() < 60


def test_the_page_shows_all_models_and_each_alone(scene: MarkerScene) -> None:
    page = scene_picture(scene, fullest_frame(scene.labelled), "capture")
    width, height = model_view(scene, 0, 0).camera.width, model_view(scene, 0, 0).camera.height
    assert page.shape[0] > 2 * height
    assert page.shape[1] > 2 * width


def test_the_fullest_frame_has_all_poses_and_the_most_markers(scene: MarkerScene) -> None:
    frame = fullest_frame(scene.labelled)
    counts = np.sum([(columns >= 0).sum(axis=1) for columns in scene.labelled.columns], axis=0)
    posed = np.isfinite(scene.labelled.poses[0]).all(axis=1)
    assert counts[frame] == counts[posed].max()


def test_a_lost_hand_is_not_drawn_and_its_markers_have_no_rings(scene: MarkerScene) -> None:
    labelled = scene.labelled
    nowhere = replace(labelled, poses=tuple(np.full_like(poses, np.nan) for poses in labelled.poses))
    columns = tuple(np.full_like(each, -1) for each in labelled.columns)
    empty = MarkerScene.of(replace(nowhere, columns=columns, capture=replace(labelled.capture)))
    view = whole_view(scene)
    drawn = empty.draw(0, view)
    colours = np.unique(drawn.reshape(-1, 3), axis=0)
    assert len(colours) < len(np.unique(scene.draw(0, view).reshape(-1, 3), axis=0)) / 4


@given(seed=st.integers(0, 1000), count=st.integers(0, 30))
def test_names_stay_in_the_picture_and_start_near_their_points(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform([150, 150], [490, 330], (count, 2))
    sizes = np.stack([rng.uniform(20, 90, count), np.full(count, 12.0)], axis=-1)
    corners = place_names(points, sizes, (480, 640), clearance=8)
    assert np.all(corners >= 0)
    assert np.all(corners + sizes <= [640, 480])
    nearest = np.clip(points, corners, corners + sizes)
    assert np.all(np.linalg.norm(nearest - points, axis=1) <= 8 + 74 + 1e-9)


def test_names_of_distant_points_do_not_overlap() -> None:
    points = np.array([[100.0, 100], [100, 116], [104, 132]])
    sizes = np.full((3, 2), [60.0, 12.0])
    corners = place_names(points, sizes, (300, 300), clearance=8)
    for a in range(3):
        for b in range(a):
            low, high = np.maximum(corners[a], corners[b]), np.minimum(corners[a], corners[b]) + sizes[0]
            assert np.any(high <= low)


def test_residuals_are_drawn_with_equal_bytes_and_clear_where_they_are_large(scene: MarkerScene) -> None:
    first, second = (residual_png(scene.labelled, "capture") for _ in range(2))
    assert first == second
    plain = np.asarray(Image.open(BytesIO(first)).convert("RGB")).astype(int)
    poses = tuple(each.copy() for each in scene.labelled.poses)
    poses[1][40:50, 0] += 0.02
    moved = residual_png(replace(scene.labelled, poses=poses), "capture")
    changed = np.abs(np.asarray(Image.open(BytesIO(moved)).convert("RGB")).astype(int) - plain)
    assert changed.max() > 100


def test_a_video_has_a_picture_for_each_thirtieth_of_a_second(scene: MarkerScene, tmp_path: Path) -> None:
    shown: list[int] = []

    def watch(frames: object) -> object:
        shown.extend(frames)  # type: ignore[arg-type]
        return shown

    count = write_marker_video(scene, tmp_path / "out.mp4", height=96, progress=watch)  # type: ignore[arg-type]
    assert shown == list(range(0, 60, 4))
    video = cv2.VideoCapture(str(tmp_path / "out.mp4"))
    assert count == video.get(cv2.CAP_PROP_FRAME_COUNT) == 15
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(RATE / 4)


@pytest.mark.skipif(find_spec("rerun") is None, reason="rerun-sdk is not installed (the extra 'view')")
def test_the_viewer_saves_every_frame(scene: MarkerScene, tmp_path: Path) -> None:
    from depthtrack.viewing.rerun_marker_viewer import RerunMarkerViewer

    assert RerunMarkerViewer(scene, "capture").save(tmp_path / "out.rrd", range(60)) == 60
    content = (tmp_path / "out.rrd").read_bytes()
    assert b"world/right/markers" in content
    assert b"world/box/markers" in content
