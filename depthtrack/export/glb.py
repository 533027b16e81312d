"""Export to animated glTF (GLB): the skin of the run's hand moved by its joints.

It needs the extra `gltf` (pygltflib). Source: Khronos, glTF 2.0 Specification, sections "Skins" and "Animations".
"""

from pathlib import Path

from depthtrack.export.axes import export_transform
from depthtrack.export.joint_track import JointTrack
from depthtrack.hand.rig.gltf_writer import export_animation
from depthtrack.hand.skin.mesh import Skin


def write(track: JointTrack, path: Path) -> None:
    """Write the skin and a key for each frame with a pose.

    Time starts at the first frame of the run.

    Raises:
        InputError: if no frame has a pose, the skin cannot be built, or the file cannot be written.
        MissingExtraError: if pygltflib is not installed.
    """
    track.check_posed()
    times = track.timestamps[track.posed] - track.timestamps[0]
    export_animation(Skin.of(track.hand), path, times, track.poses[track.posed], export_transform(track))
