"""Timeline of a run: energy over time, lost frames and a cursor."""

import cv2
import numpy as np

from depthtrack.recording.status import Status
from depthtrack.types import Array, Image
from depthtrack.viewing.panels import blank
from depthtrack.viewing.text import put_text
from depthtrack.viewing.theme import BACKGROUND, FAINT_TEXT, STATUS_COLOURS, SURFACE, TEXT

HEIGHT = 84
_TOP, _BOTTOM = 24, 12
_SUBPIXEL_BITS = 4


class Timeline:
    """The timeline of a run.

    image (HEIGHT, width, 3): without a cursor; drawn once for all frames.
    """

    def __init__(self, energy: Array, status: tuple[Status, ...], width: int) -> None:
        """Draw the timeline.

        energy (T,): NaN without an energy.
        status (T,): of each frame.
        width: pixels.
        """
        self._width, self._count = width, len(energy)
        self.image = blank(width, HEIGHT, SURFACE)
        known = energy[np.isfinite(energy)]
        # The percentile keeps the energy of lost frames from compressing the scale.
        self._top = float(max(1.2 * np.percentile(known, 98), 1e-6)) if len(known) else 1.0
        for row, found in enumerate(status):
            if not found.is_trusted:
                left, right = self._x(row - 0.5), self._x(row + 0.5)
                colour = np.array(STATUS_COLOURS[found]) * 0.35 + np.array(SURFACE) * 0.65
                self.image[_TOP:, left : max(right, left + 1)] = np.rint(colour)
        self._draw_curve(energy)
        put_text(self.image, f"energy, 0 to {self._top:.3g}", (8, _TOP // 2), 13, FAINT_TEXT)

    def with_cursor(self, row: int, note: str = "") -> Image:
        """Return the timeline (HEIGHT, width, 3) with a cursor and a note beside the title."""
        image = self.image.copy()
        x = self._x(row)
        image[_TOP:, max(x - 1, 0) : x + 1] = TEXT
        put_text(image, note, (180, _TOP // 2), 13, TEXT)
        return image

    def _x(self, row: float) -> int:
        return round(np.clip((row + 0.5) / max(self._count, 1), 0, 1) * (self._width - 1))

    def _draw_curve(self, energy: Array) -> None:
        height = HEIGHT - _TOP - _BOTTOM
        y = _TOP + height * (1 - np.clip(energy / self._top, 0, 1))
        x = (np.arange(self._count) + 0.5) / max(self._count, 1) * (self._width - 1)
        points = np.stack([x, y], axis=-1)
        finite = np.isfinite(y)
        # Each interval without a gap is one polyline.
        for interval in np.split(np.arange(self._count), np.flatnonzero(np.diff(finite)) + 1):
            if len(interval) and finite[interval[0]]:
                fixed = np.rint(points[interval] * (1 << _SUBPIXEL_BITS)).astype(np.int32)
                cv2.polylines(self.image, [fixed], False, BACKGROUND, 4, cv2.LINE_AA, _SUBPIXEL_BITS)
                cv2.polylines(self.image, [fixed], False, TEXT, 1, cv2.LINE_AA, _SUBPIXEL_BITS)
