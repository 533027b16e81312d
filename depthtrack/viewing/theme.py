"""RGB colours of all pictures, for a dark background and colour vision deficiency."""

from depthtrack.recording.status import Status

Rgb = tuple[int, int, int]

BACKGROUND: Rgb = (13, 17, 23)
SURFACE: Rgb = (24, 30, 40)
TEXT: Rgb = (230, 237, 243)
FAINT_TEXT: Rgb = (139, 148, 158)

NO_READING: Rgb = (7, 9, 13)
"""Depth pixels without a reading; darker than any depth."""

TRUE_MASK: Rgb = (34, 211, 238)
ESTIMATED_MASK: Rgb = (240, 80, 230)
OCCLUDER: Rgb = (190, 242, 100)
"""All differ from each other, from skin and from the depth scale's near end."""

PALM: Rgb = (226, 232, 240)
FINGER_COLOURS: dict[str, Rgb] = {
    "thumb": (251, 113, 133),
    "index": (251, 191, 36),
    "middle": (74, 222, 128),
    "ring": (56, 189, 248),
    "little": (192, 132, 252),
}
HIDDEN: Rgb = (92, 99, 110)
"""Colour of a finger that is hidden."""
FINGER_TRUTH: dict[str, Rgb] = dict.fromkeys(("palm", *FINGER_COLOURS), TRUE_MASK)
"""Colours of a true skeleton beside a tracked one."""
OUTLINE: Rgb = (10, 12, 18)
"""Rim around lines and joints, for contrast on bright images."""

STATUS_COLOURS: dict[Status, Rgb] = {
    Status.TRACKED: (74, 222, 128),
    Status.STARTED: (56, 189, 248),
    Status.LOST: (251, 113, 133),
    Status.ABSENT: FAINT_TEXT,
}
"""Colours of the status of a run's frame."""
