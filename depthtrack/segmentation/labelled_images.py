"""Images with skin labels, to train a skin colour model on: two folders of files, or a recording that knows masks."""

from collections.abc import Iterator
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.geometry.camera import MAX_SIDE
from depthtrack.recording import open_sequence
from depthtrack.recording.images import read_colour, read_mask, read_size
from depthtrack.types import Labels, Mask

Labelled = tuple[Labels, Mask]

_PICTURES = (".png", ".jpg", ".jpeg")


def from_folders(images: Path, masks: Path) -> Iterator[Labelled]:
    """Pairs of an RGB image (h, w, 3) and its mask (h, w), true on skin, whose files have the same name but ending.

    Raises InputError where a folder or a file's partner is missing, a file is damaged, or sizes differ.
    """
    pictures, partners = _pictures(images), _pictures(masks)
    for stem, path in sorted(pictures.items()):
        if stem not in partners:
            raise InputError(f"{path.name} has no mask of the same name in {masks}")
        width, height = read_size(path)
        if max(width, height) > MAX_SIDE:
            raise InputError(f"{path} is {width}x{height} pixels: at most {MAX_SIDE} a side are read")
        shape = (height, width)
        yield read_colour(path, shape), read_mask(partners[stem], shape)


def from_recording(path: Path) -> Iterator[Labelled]:
    """Every frame of a recording with colour and a true silhouette. Raises InputError where there is none."""
    sequence = open_sequence(path, on_damage="skip")
    none_yet = True
    for frame in sequence:
        mask = sequence.hand_mask(frame.index)
        if frame.colour is not None and mask is not None:
            none_yet = False
            yield frame.colour, mask
    if none_yet:
        raise InputError(f"{path} has no frame with colour and a true mask: give a folder of images and one of masks")


def _pictures(folder: Path) -> dict[str, Path]:
    if not folder.is_dir():
        raise InputError(f"{folder} must be a folder of pictures")
    found = {path.stem: path for path in folder.iterdir() if path.suffix.lower() in _PICTURES}
    if not found:
        raise InputError(f"{folder} holds no pictures ({', '.join(_PICTURES)})")
    return found
