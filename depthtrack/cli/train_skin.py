"""`depthtrack train-skin`: a skin colour model from labelled images."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from depthtrack.cli.progress import bar


@dataclass(frozen=True)
class Command:
    """Learn skin colours where the published statistics do not fit: other light, other cameras.

    Give a folder of images and one of masks, white on skin, with the same names; or a recording with colour and
    hand_mask/, whose forearms should then be covered. Use the result with --skin-model.
    """

    images: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="IMAGES")]
    """Folder of images, or a recording."""
    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="FILE.json")]
    """Where to write the model."""
    masks: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="MASKS")] = None
    """Folder of masks; not needed for a recording."""

    def run(self) -> None:
        from depthtrack.segmentation.labelled_images import from_folders, from_recording
        from depthtrack.segmentation.skin_colour import SkinColourModel

        labelled = from_recording(self.images) if self.masks is None else from_folders(self.images, self.masks)
        model = SkinColourModel.train(bar(labelled, "image"))
        model.save(self.out)
        print(f"{self.out}: {100 * model.prior:.1f} % of the pixels were skin; use it with --skin-model {self.out}")
