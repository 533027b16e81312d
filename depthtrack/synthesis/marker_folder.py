"""The folder of a synthetic marker capture.

| file                  | content                                                                          |
|-----------------------|----------------------------------------------------------------------------------|
| capture.csv           | points without labels, shuffled in each frame; or .c3d, .trc                     |
| models/NAME.json      | models that a user has: the layout on a hand of stated sizes, measured bodies    |
| synthesis.json        | all options                                                                      |
| truth/                | a marker folder: labels, poses and models of the subject, see `markers.folder`   |
| truth/complete.csv    | all markers, labelled, without noise and gaps                                    |
"""

from pathlib import Path

from depthtrack.files import compact_json, new_folder, write_atomic
from depthtrack.markers.folder.contents import MODELS, check_names
from depthtrack.markers.folder.writing import write_marker_folder
from depthtrack.markers.formats.registry import write_capture
from depthtrack.synthesis.marker_capture import SyntheticMarkers

SYNTHESIS_FILE = "synthesis.json"
TRUTH = "truth"
COMPLETE_FILE = "complete.csv"


def write_synthetic_markers(
    synthetic: SyntheticMarkers, folder: Path, suffix: str = ".csv", overwrite: bool = False
) -> None:
    """Write a synthetic capture to a folder, complete or not at all.

    suffix: of the capture, as `write_capture` knows it.

    Raises:
        InputError: if the folder exists and must not be replaced, or cannot be written.
    """
    check_names([model.name for model in synthetic.models])
    with new_folder(folder, SYNTHESIS_FILE, "a synthetic marker capture", overwrite) as work:
        write_capture(work / f"capture{suffix}", synthetic.capture)
        (work / MODELS).mkdir()
        for model in synthetic.models:
            write_atomic(work / MODELS / f"{model.name}.json", model.to_json())
        write_marker_folder(work / TRUTH, synthetic.truth, truth=synthetic.truth)
        write_capture(work / TRUTH / COMPLETE_FILE, synthetic.complete)
        write_atomic(work / SYNTHESIS_FILE, compact_json(synthetic.options.description()))
