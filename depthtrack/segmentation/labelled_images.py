"""Images with skin labels, to train a skin colour model."""

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
    """Yield pairs of an RGB image (h, w, 3) and its mask (h, w), true on skin.

    Image and mask have the same file name except for its extension.

    Raises:
        InputError: a folder or a mask is missing, a file is damaged, or sizes differ.
    """
    pictures, partners = _pictures(images), _pictures(masks)
    for stem, path in sorted(pictures.items()):
        if stem not in partners:
            raise InputError(f"{path.name} has no mask of the same name in {masks}")
        width, height = read_size(path)
        if max(width, height) > MAX_SIDE:
            raise InputError(f"{path} is {width}x{height} pixels: use images of at most {MAX_SIDE} pixels a side")
        shape = (height, width)
        yield read_colour(path, shape), read_mask(partners[stem], shape)


def from_recording(path: Path) -> Iterator[Labelled]:
    """Yield the RGB image (h, w, 3) and true silhouette (h, w) of each frame with both.

    Raises:
        InputError: no frame has both.
    """
    sequence = open_sequence(path, on_damage="skip")
    is_empty = True
    for frame in sequence:
        mask = sequence.hand_mask(frame.index)
        if frame.colour is not None and mask is not None:
            is_empty = False
            yield frame.colour, mask
    if is_empty:
        raise InputError(f"{path} has no frame with colour and a true mask: give a folder of images and one of masks")


def _pictures(folder: Path) -> dict[str, Path]:
    if not folder.is_dir():
        raise InputError(f"{folder} must be a folder of pictures")
    found = {path.stem: path for path in folder.iterdir() if path.suffix.lower() in _PICTURES}
    if not found:
        raise InputError(f"{folder} holds no pictures ({', '.join(_PICTURES)})")
    return found
