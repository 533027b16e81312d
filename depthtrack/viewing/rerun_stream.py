"""Output of the interactive viewer: a window, a browser or a file.

It needs the extra `view` (rerun-sdk).
"""

import shutil
import socket
import sysconfig
from abc import ABC, abstractmethod
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Generic, TypeVar

from depthtrack.errors import InputError
from depthtrack.export.rrd import rerun_library
from depthtrack.files import replace_atomically
from depthtrack.geometry.camera import Camera
from depthtrack.viewing.theme import ESTIMATED_MASK, TRUE_MASK

CAMERA = "world/camera"
TRUE_CLASS, ESTIMATED_CLASS = 1, 2

Item = TypeVar("Item")


class RerunStream(ABC, Generic[Item]):
    """A stream of items to rerun; subclasses define the items.

    Call `open_window`, `serve` or `save` before the first `log`.

    near, far: ends of the depth colours, metres.
    Raises: MissingExtraError if rerun is not installed.
    """

    def __init__(self, name: str, camera: Camera, near: float, far: float) -> None:
        self._rr = rerun_library()
        self._stream = self._rr.RecordingStream("depthtrack", recording_id=None)
        self._stream.send_recording_name(name)
        self._range = near, far
        self._camera = camera

    @abstractmethod
    def log(self, item: Item) -> None:
        """Send an item at its time; entities without a value are cleared."""

    @abstractmethod
    def _layout(self) -> Any:
        """Return the blueprint of the viewer's panels."""

    def open_window(self) -> None:
        """Start rerun's window, which outlives this program.

        Raises: InputError if it cannot start.
        """
        # The executable of this environment, which is not on PATH without activation.
        program = shutil.which("rerun", path=sysconfig.get_path("scripts"))
        try:
            self._rr.spawn(executable_path=program, recording=self._stream, default_blueprint=self._layout())
        except RuntimeError as error:
            reason = str(error).strip().partition("\n")[0]
            raise InputError(
                f"the viewer's window cannot start ({reason}): write an .rrd file or a contact sheet instead"
            ) from error
        self._log_static()

    def serve(self, open_browser: bool = True) -> str:
        """Serve the viewer to browsers until this process ends, and return its address.

        Rerun listens on every network interface, so every host with access to this machine's ports can connect.

        Raises: InputError if no network port is free.
        """
        port = _free_port(9090)
        source = self._stream.serve_grpc(grpc_port=_free_port(9876), default_blueprint=self._layout())
        self._rr.serve_web_viewer(web_port=port, open_browser=open_browser, connect_to=source)
        self._log_static()
        return f"http://localhost:{port}/?url={source}"

    def close(self) -> None:
        """Flush and close the stream."""
        self._stream.flush()
        self._stream.disconnect()

    def save(self, path: Path, items: Iterable[Item]) -> int:
        """Write items to an .rrd file and return their number.

        Raises: InputError if the suffix is another one or the file cannot be written.
        """
        if path.suffix.lower() != ".rrd":
            raise InputError(f"a rerun recording must end in .rrd, found '{path.name}'")
        count = 0
        with replace_atomically(path) as temporary:
            try:
                self._stream.save(temporary, default_blueprint=self._layout())
                self._log_static()
                for item in items:
                    self.log(item)
                    count += 1
            finally:
                self.close()
        return count

    def _log_static(self) -> None:
        rr, camera = self._rr, self._camera
        self._stream.log("world", rr.ViewCoordinates.RDF, static=True)
        pinhole = rr.Pinhole(
            image_from_camera=camera.matrix,
            resolution=[camera.width, camera.height],
            camera_xyz=rr.ViewCoordinates.RDF,
            image_plane_distance=0.1,
        )
        self._stream.log(CAMERA, pinhole, static=True)
        classes = [
            rr.AnnotationInfo(id=0, color=(0, 0, 0, 0)),
            rr.AnnotationInfo(id=TRUE_CLASS, label="true mask", color=TRUE_MASK),
            rr.AnnotationInfo(id=ESTIMATED_CLASS, label="estimated mask", color=ESTIMATED_MASK),
        ]
        self._stream.log(CAMERA, rr.AnnotationContext(classes), static=True)

    def _log_or_clear(self, entity: str, content: Any | None) -> None:
        self._stream.log(entity, self._rr.Clear(recursive=False) if content is None else content)


def _free_port(default: int) -> int:
    """Return the default port, or any free one if it is in use.

    Rerun itself only logs a failure.
    """
    for port in (default, 0):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("", port))
            except OSError:
                continue
            return int(probe.getsockname()[1])
    raise InputError("the viewer cannot be served: no network port is free")
