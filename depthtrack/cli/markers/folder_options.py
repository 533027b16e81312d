"""Options of the commands that write a marker folder, and its pictures."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

if TYPE_CHECKING:
    from depthtrack.markers.models.marker_model import MarkerModel
    from depthtrack.viewing.marker_scene import MarkerScene


@dataclass(frozen=True)
class FolderOptions:
    """Folder to write."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="OUT")]
    """Folder to write: labels, poses, confidence, residuals, and a run folder of each hand."""
    format: Literal["csv", "c3d", "trc"] = "csv"
    """Format of the labelled trajectories."""
    pictures: bool = True
    """Also draw the labelled scene and the residual of each marker over time."""

    def check(self, models: "tuple[MarkerModel, ...]") -> None:
        """Check the folder before the work starts.

        Raises:
            InputError: if it is in use, or the name of a model cannot be that of a file.
        """
        from depthtrack.markers.folder.writing import check_output

        check_output(self.out, tuple(model.name for model in models), f".{self.format}")

    def draw(self, scene: "MarkerScene", title: str) -> None:
        """Draw `scene.png` and `residual.png`, if wanted.

        Raises:
            InputError: if a file cannot be written.
        """
        if not self.pictures:
            return
        from depthtrack.files import write_atomic
        from depthtrack.viewing.contact_sheet import save_picture
        from depthtrack.viewing.marker_pictures import fullest_frame, scene_picture
        from depthtrack.viewing.marker_residuals import residual_png

        save_picture(scene_picture(scene, fullest_frame(scene.labelled), title), self.out / "scene.png")
        heading = f"{title}: distance of measured markers from those of the pose"
        write_atomic(self.out / "residual.png", residual_png(scene.labelled, heading))
