"""Reading and writing of RGB-D recordings: one protocol, one module a format."""

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
