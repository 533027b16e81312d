"""Options of the commands that write a marker folder, and its pictures."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FOLDER

if TYPE_CHECKING:
    from depthtrack.markers.filled_capture import FilledCapture
    from depthtrack.markers.folder.contents import Source
    from depthtrack.markers.initialisation.started import StartedModels
    from depthtrack.markers.labelled_capture import LabelledCapture
    from depthtrack.markers.models.marker_model import MarkerModel
    from depthtrack.viewing.marker_scene import MarkerScene


@dataclass(frozen=True)
class FolderOptions:
    """Folder to write."""

    out: Annotated[Path, OUTPUT_FOLDER, tyro.conf.arg(aliases=("-o",), metavar="OUT")]
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

    def write(
        self,
        labelled: "LabelledCapture",
        source: "Path | Source | None",
        configuration: dict[str, Any],
        filled: "FilledCapture | None" = None,
        started: "StartedModels | None" = None,
    ) -> None:
        """Write the folder, with the true poses of a synthetic capture, and the pictures.

        source: file of the capture; as an earlier folder states it, or its path.
        started: start of the models, which another labelling may use.

        Raises:
            InputError: if a file cannot be written.
        """
        from depthtrack.markers.folder.contents import Source
        from depthtrack.markers.folder.reading import truth_beside
        from depthtrack.markers.folder.writing import new_marker_folder, write_marker_files
        from depthtrack.markers.initialisation.started import save_started
        from depthtrack.viewing.marker_scene import MarkerScene

        if isinstance(source, Path):
            source = Source.of(source)
        truth = None if source is None else truth_beside(Path(source.path))
        with new_marker_folder(self.out) as work:
            write_marker_files(work, labelled, source, configuration, truth, f".{self.format}", filled)
            if started is not None:
                save_started(started, work / "start.json")
            if self.pictures:
                scene = MarkerScene.of(labelled) if filled is None else MarkerScene.of_filled(filled)
                self._draw(scene, self.out.name if source is None else Path(source.path).name, work)

    def _draw(self, scene: "MarkerScene", title: str, folder: Path) -> None:
        from depthtrack.files import write_atomic
        from depthtrack.viewing.contact_sheet import save_picture
        from depthtrack.viewing.marker_pictures import fullest_frame, scene_picture
        from depthtrack.viewing.marker_residuals import residual_png

        save_picture(scene_picture(scene, fullest_frame(scene.labelled), title), folder / "scene.png")
        heading = f"{title}: distance of measured markers from those of the pose"
        write_atomic(folder / "residual.png", residual_png(scene.labelled, heading))
