"""The hand in a frame: start anywhere, then follow it from its last position (Oikonomidis et al. 2011, Sec. 2.1)."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.camera import Camera
from depthtrack.observation.grid import Grid, Mask, share_of_blocks
from depthtrack.observation.hand_pixels import ARM, BESIDE, HAND, OTHER, READING, hand_pixels
from depthtrack.observation.palm import HAND_REACH, SMALLEST_AREA, TIP_TO_WRIST, Palm, find_palms, finger_area
from depthtrack.observation.skin_colour import (
    MAYBE_SKIN,
    SURELY_SKIN,
    AdaptiveSkin,
    SkinModel,
    classify,
    grow_skin,
)
from depthtrack.observation.wrist import Arm, WristFilter, WristPlane, arm_nodes, find_arm, find_wrist, narrowest_place
from depthtrack.recording.sequence import Frame

Array = NDArray[np.float64]

DEPTH_WINDOW = 0.25
"""Metres around the last position that are searched (ibid.)."""

DILATION = 5 / 640
"""Radius of the circular dilation (ibid.), as a share of the image's width: 5 pixels of 640."""

NEAREST, FARTHEST = 0.1, 2.75
"""Metres from the camera at which a hand is looked for; the paper tracks up to 2.5 m."""

NODE_SIZE = 0.005
"""Metres that a grid node spans: a third of a finger's breadth."""

MEMORY = 0.5
"""Seconds for which the last position is worth something: a hand crosses the window in less."""

SLICE, SLICE_STEP = 0.35, 0.2
"""Metres: a start looks at the nearest things first, in slices this thick: a hand and a forearm that points away."""

SURE_COST = -0.05
"""Metres: a palm of usual breadth within 5 cm of its last position needs no comparison with others."""

LARGEST_STEP = 0.15
"""Metres that a palm moves between frames, at most: 4.5 m/s at 30 Hz. What is farther is something else."""

ROOM = 0.04
"""Metres around the hand that the region of interest leaves for hypotheses to move in."""


class Window(NamedTuple):
    """A rectangle of pixels; `right` and `bottom` are excluded."""

    left: int
    top: int
    right: int
    bottom: int

    @classmethod
    def around(cls, camera: Camera, centre: Array, reach: float) -> "Window":
        """Pixels that may see points within `reach` metres of `centre` (3,) across the line of sight."""
        (u, v), z = camera.project(centre), float(centre[2])
        du, dv = camera.fx * reach / z, camera.fy * reach / z
        return cls(
            min(max(int(u - du), 0), camera.width - 1),
            min(max(int(v - dv), 0), camera.height - 1),
            max(min(int(u + du) + 1, camera.width), 1),
            max(min(int(v + dv) + 1, camera.height), 1),
        )

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns, to index an image with."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def within(self, outer: "Window") -> "Window":
        """This window of a picture that is itself the window `outer` of another, as a window of that other."""
        left, top = outer.left, outer.top
        return Window(self.left + left, self.top + top, self.right + left, self.bottom + top)


@dataclass(frozen=True)
class View:
    """A window of a frame with its own `camera`; `depth` (h, w) metres, `colour` (h, w, 3) or None where only depth
    is used, `skin` (h, w) not 0 where the colour is skin, everywhere without colour.

    `grid` of everything within reach, and `surface`, its nodes that may be hand. `dilation` is the paper's r.
    """

    window: Window
    camera: Camera
    depth: NDArray[np.float32]
    colour: NDArray[np.uint8] | None
    skin: NDArray[np.uint8]
    grid: Grid
    surface: Grid
    dilation: int


@dataclass(frozen=True)
class Segmentation:
    """A hand found in a frame. Masks cover `window` of the frame, which leaves room around the hand.

    `skin` (h, w) the hand's silhouette; `readings` (h, w) where the depth is the hand's; `centre` (3,) of the palm on
    the visible surface, metres, camera frame; `palm_radius` of the circle inscribed in it; `arm_direction` (3,) unit,
    from the palm along the forearm, or None where no arm is seen; `wrist` the plane of the cut, if any.
    """

    window: Window
    skin: Mask
    readings: Mask
    centre: Array
    palm_radius: float
    arm_direction: Array | None
    wrist: WristPlane | None


class Segmenter:
    """Finds the hand frame after frame. Remembers only where it was last, and the colours around it.

    `skin_model` is used where frames have colour; None uses depth alone. `wrist_margin` (metres) keeps that much of
    the forearm beyond the wrist.
    """

    def __init__(self, skin_model: SkinModel | None = None, wrist_margin: float = 0.0) -> None:
        self._skin = None if skin_model is None else AdaptiveSkin(skin_model)
        self._wrist_margin = wrist_margin
        self._wrist = WristFilter()
        self.reset()

    def reset(self) -> None:
        """Forget where the hand was, and what the recording's colours were."""
        self._last: Array | None = None
        self._last_time = 0.0
        self._arm_direction: Array | None = None
        self._wrist.forget()
        if self._skin is not None:
            self._skin.forget()

    def segment(self, frame: Frame, wrist: WristPlane | None = None) -> Segmentation | None:
        """The hand, or None where none is seen. `wrist` is where a tracker expects it, and replaces our own cut."""
        if not 0 <= frame.timestamp - self._last_time <= MEMORY:
            self._last = None
        found = None if self._last is None else self._follow(frame, self._last, wrist)
        if found is None:
            self._arm_direction = None
            self._wrist.forget()
            start = self._start(frame)
            found = None if start is None else self._follow(frame, start, wrist)
        self._last = None if found is None else found.centre
        self._last_time = frame.timestamp
        return found

    def _view(self, frame: Frame, window: Window, reach: tuple[float, float], stride: int) -> View:
        """What is seen of a window of the frame, at distances within `reach`."""
        left, top, right, bottom = window
        camera = frame.camera.crop(left, top, right - left, bottom - top)
        depth = np.ascontiguousarray(frame.depth[window.slices])
        grid = Grid.over(depth, camera, reach, stride)
        dilation = max(1, round(DILATION * frame.camera.width))
        if self._skin is None or frame.colour is None:
            return View(window, camera, depth, None, np.ones(depth.shape, np.uint8), grid, grid, dilation)
        colour = np.ascontiguousarray(frame.colour[window.slices])
        # Colour is asked only about what is within reach, and right beside it: edges of depth are ragged.
        beside = cv2.dilate((grid.depth > 0).astype(np.uint8), _disc(1))
        classes, skin = np.empty(depth.shape, np.uint8), np.empty(depth.shape, np.uint8)
        classify(colour, self._skin.classes(), beside, stride, classes)
        grow_skin(classes, skin)
        return View(window, camera, depth, colour, skin, grid, grid.within(skin_nodes(skin, grid)), dilation)

    def _start(self, frame: Frame) -> Array | None:
        """Where a hand is (3,), metres, looking at the whole frame."""
        whole = Window(0, 0, frame.camera.width, frame.camera.height)
        view = self._view(frame, whole, (NEAREST, FARTHEST), max(1, round(frame.camera.width / 160)))
        return find_start(view.grid, view.surface)

    def _follow(self, frame: Frame, last: Array, wrist: WristPlane | None) -> Segmentation | None:
        """The hand within DEPTH_WINDOW of its last position (3,)."""
        z = float(last[2])
        window = Window.around(frame.camera, last, DEPTH_WINDOW)
        reach = (max(z - DEPTH_WINDOW, NEAREST), z + DEPTH_WINDOW)
        view = self._view(frame, window, reach, max(1, round(NODE_SIZE * frame.camera.fx / z)))
        palm = nearest_palm(view.grid, view.surface, last)
        if palm is None:
            return None
        arm = find_arm(view.grid, palm, self._arm_direction)
        self._arm_direction = None if arm is None else arm.direction
        if arm is not None and wrist is None:
            distance = self._wrist.update(palm, arm, find_wrist(view.grid, palm, arm)) + self._wrist_margin
            wrist = WristPlane(palm.centre + distance * arm.direction, arm.direction)
        labels = label_hand(view.grid, view.surface, palm, arm, wrist)
        roi, skin, readings = hand_masks(view, labels, wrist)
        self._learn(view, roi, skin)
        return Segmentation(roi.within(window), skin, readings, palm.centre, palm.radius, self._arm_direction, wrist)

    def _learn(self, view: View, roi: Window, hand: Mask) -> None:
        """Adapt to the colours of the hand's skin and of what is no skin; skin elsewhere, as the arm's, is left out."""
        if self._skin is not None and view.colour is not None:
            skin = view.skin[roi.slices] > 0
            labels = np.where(skin == hand, skin * np.uint8(SURELY_SKIN), np.uint8(MAYBE_SKIN))
            self._skin.learn(view.colour[roi.slices], labels)


def find_start(grid: Grid, surface: Grid) -> Array | None:
    """Where a hand is (3,), metres, among the nodes of `surface` that may be hand; nearest things first."""
    depths = np.sort(surface.depth[surface.depth > 0])
    area = np.cumsum(depths**2) / (grid.camera.fx * grid.camera.fy)
    if area.size == 0 or area[-1] < SMALLEST_AREA:
        return None
    # Up to here, everything visible together is too small to be a hand.
    start = float(depths[np.searchsorted(area, SMALLEST_AREA)])
    while start < depths[-1]:
        part = (grid.depth > start - SLICE_STEP) & (grid.depth < start + SLICE)
        here = surface.within(part)
        palms = list(find_palms(grid.within(part), here))
        if palms:
            return min(palms, key=lambda palm: start_cost(grid.within(part), here, palm)).centre
        start += SLICE_STEP
    return None


def start_cost(grid: Grid, surface: Grid, palm: Palm) -> float:
    """Metres: how near a palm is, less what speaks for it: breadth, fingers, and a wrist right behind it."""
    arm = find_arm(grid, palm)
    wristless = 0.1 if arm is None else min(max(narrowest_place(grid, palm, arm) - 0.06, 0), 0.15)
    fingers = min(40 * finger_area(surface, palm), 0.1)
    return 0.25 * float(palm.centre[2]) + wristless - palm_bonus(palm) - fingers


def nearest_palm(grid: Grid, surface: Grid, last: Array) -> Palm | None:
    """The palm nearest to its last position (3,), if there is any."""
    nearest, lowest = None, np.inf
    for palm in find_palms(grid, surface):
        distance = float(np.linalg.norm(palm.centre - last))
        cost = distance - palm_bonus(palm)
        if cost < lowest and distance < LARGEST_STEP:
            nearest, lowest = palm, cost
        if cost < SURE_COST:
            break
    return nearest


def palm_bonus(palm: Palm) -> float:
    """Metres of distance that a palm's breadth makes up for: narrow places are fingers, or edges of things."""
    return 3 * min(palm.radius, 0.042)


def skin_nodes(skin: NDArray[np.uint8], grid: Grid) -> Mask:
    """Nodes (rows, columns) of which a quarter is skin, and gaps among them up to 4 nodes wide: a shadow, a ring."""
    share = np.empty(grid.depth.shape, dtype=np.float32)
    share_of_blocks(skin, grid.stride, share)
    return cv2.morphologyEx((share >= 0.25).astype(np.uint8), cv2.MORPH_CLOSE, _disc(2)) > 0


def label_hand(grid: Grid, surface: Grid, palm: Palm, arm: Arm | None, wrist: WristPlane | None) -> NDArray[np.uint8]:
    """ELSEWHERE, HAND or ARM (rows, columns) for every node."""
    hand = (surface.depth > 0) & (palm.paths.distance < TIP_TO_WRIST)
    # Fingertips cut off by what the hand holds, or by fingers in front, are pieces of surface within its reach.
    pieces, _ = surface.within(~hand).surfaces()
    nodes = np.flatnonzero(pieces >= 0)
    points, piece = surface.points(nodes), pieces.flat[nodes]
    inside = np.linalg.norm(points - palm.centre, axis=1) < HAND_REACH
    if wrist is not None:
        inside &= (points - wrist.point) @ wrist.normal < 0
    sizes = np.bincount(piece)
    whole = np.bincount(piece, inside, sizes.size) > 0.9 * sizes
    hand.flat[nodes[whole[piece]]] = True
    labels = np.where(np.isfinite(palm.paths.distance), np.uint8(BESIDE), np.uint8(0))
    labels[hand] = HAND
    if arm is not None and wrist is not None:
        labels[arm_nodes(grid, palm, arm, wrist)] = ARM
    return labels


def hand_masks(view: View, labels: NDArray[np.uint8], wrist: WristPlane | None) -> tuple[Window, Mask, Mask]:
    """The window of the view around the hand, with its silhouette and its readings (h, w).

    Within r of the outline of its readings, where depth is least sure, colour decides what is hand; farther inside,
    depth alone does, so that shadows and highlights leave no holes. Readings count up to r outside the silhouette.
    """
    grid, stride = view.grid, view.grid.stride
    room = 1 + round(ROOM * grid.camera.fx / float(grid.depth[labels == HAND].mean()))
    rows, columns = np.flatnonzero((labels == HAND).any(axis=1)), np.flatnonzero((labels == HAND).any(axis=0))
    top, bottom = max(int(rows[0]) - room, 0), int(rows[-1]) + 1 + room
    left, right = max(int(columns[0]) - room, 0), int(columns[-1]) + 1 + room
    blocks = Window(left, top, min(right, labels.shape[1]), min(bottom, labels.shape[0]))
    height, width = view.depth.shape
    roi = Window(left * stride, top * stride, min(blocks.right * stride, width), min(blocks.bottom * stride, height))

    plane = (0.0, 0.0, 0.0, 0.0) if wrist is None else (*wrist.normal, float(wrist.normal @ wrist.point))
    camera = view.camera
    lens = (camera.fx, camera.fy, camera.cx - roi.left, camera.cy - roi.top)
    depth = np.ascontiguousarray(view.depth[roi.slices])
    kinds = np.empty(depth.shape, dtype=np.uint8)
    hand_pixels(
        depth,
        np.ascontiguousarray(grid.depth[blocks.slices]),
        np.ascontiguousarray(labels[blocks.slices]),
        stride,
        lens,
        plane,
        kinds,
    )
    readings = kinds == READING
    if view.colour is None:
        return roi, readings, readings
    disc = _disc(view.dilation)
    inside = cv2.erode((kinds >= OTHER).astype(np.uint8), disc) > 0
    closed = cv2.morphologyEx(readings.astype(np.uint8), cv2.MORPH_CLOSE, _disc((view.dilation + 1) // 2)) > 0
    skin = (readings & inside) | ((view.skin[roi.slices] > 0) & closed & (kinds != OTHER))
    return roi, skin, readings & (cv2.dilate(skin.astype(np.uint8), disc) > 0)


def _disc(radius: int) -> NDArray[np.uint8]:
    y, x = np.ogrid[-radius : radius + 1, -radius : radius + 1]
    return (x * x + y * y <= radius * radius + 1).astype(np.uint8)
