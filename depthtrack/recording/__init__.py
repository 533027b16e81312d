"""Reading and writing RGB-D sequences: one file a format, one protocol for all of them."""

from depthtrack.recording.registry import image_size, open_sequence
from depthtrack.recording.sequence import DamagedFrame, Frame, GroundTruth, OnDamage, Sequence
from depthtrack.recording.writer import SequenceWriter

__all__ = [
    "DamagedFrame",
    "Frame",
    "GroundTruth",
    "OnDamage",
    "Sequence",
    "SequenceWriter",
    "image_size",
    "open_sequence",
]
