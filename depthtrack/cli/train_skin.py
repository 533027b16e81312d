"""`depthtrack train-skin`: train a skin colour model on labelled images."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FILE
from depthtrack.cli.progress import bar
from depthtrack.cli.stated_default import stated_default


@dataclass(frozen=True)
class Command:
    """Train a skin colour model if the published statistics do not fit the light or the camera.

    Give a folder of images and a folder of masks with the same names, white on skin. Or give a recording with colour
    and hand_mask/, in which the forearm should be covered. Use the model with --skin-model.
    """

    images: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="IMAGES")]
    """Folder of images, or a recording."""
    out: Annotated[Path, OUTPUT_FILE, tyro.conf.arg(aliases=("-o",), metavar="FILE.json")]
    """Model to write."""
    masks: Annotated[Path | None, tyro.conf.Positional, stated_default(metavar="MASKS")] = None
    """Folder of masks; leave it out for a recording."""

    def run(self) -> None:
        from depthtrack.segmentation.labelled_images import from_folders, from_recording
        from depthtrack.segmentation.skin_colour import SkinColourModel

        labelled = from_recording(self.images) if self.masks is None else from_folders(self.images, self.masks)
        model = SkinColourModel.train(bar(labelled, "image"))
        model.save(self.out)
        print(f"{self.out}: {100 * model.prior:.1f} % of the pixels were skin; use it with --skin-model {self.out}")
