"""Where the interactive viewer's data go: its window, a browser, or a file. Needs the extra `view` (rerun-sdk)."""

import importlib
import shutil
import socket
import sysconfig
from abc import ABC, abstractmethod
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Generic, TypeVar

from depthtrack.errors import InputError, MissingExtraError
from depthtrack.files import replace_atomically
from depthtrack.geometry.camera import Camera
from depthtrack.viewing.theme import ESTIMATED_MASK, TRUE_MASK

CAMERA = "world/camera"
TRUE_CLASS, ESTIMATED_CLASS = 1, 2

Item = TypeVar("Item")


class RerunStream(ABC, Generic[Item]):
    """Sends items, whatever a subclass shows, to rerun. Raises MissingExtraError without it.

    Choose one destination, `open_window`, `serve` or `save`, before the first `log`. `near` and `far` (metres) are the
    ends of the depth colours.
    """

    def __init__(self, name: str, camera: Camera, near: float, far: float) -> None:
        self._rr = _rerun()
        self._stream = self._rr.RecordingStream("depthtrack", recording_id=None)
        self._stream.send_recording_name(name)
        self._range = near, far
        self._camera = camera

    @abstractmethod
    def log(self, item: Item) -> None:
        """Show an item at its time; what it does not know is cleared, so that nothing old stays on the screen."""

    @abstractmethod
    def _layout(self) -> Any:
        """The blueprint of the viewer's panels."""

    def open_window(self) -> None:
        """Start rerun's own window, which goes on after this program ends. Raises InputError where it cannot start."""
        # The program beside this Python, which is on no PATH unless the virtual environment is activated.
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
        """Serve the viewer to browsers while this process lives; returns its address.

        Rerun listens on every network interface: whoever reaches this machine's ports can look on.
        """
        port = _free_port(9090)
        source = self._stream.serve_grpc(grpc_port=_free_port(9876), default_blueprint=self._layout())
        self._rr.serve_web_viewer(web_port=port, open_browser=open_browser, connect_to=source)
        self._log_static()
        return f"http://localhost:{port}/?url={source}"

    def close(self) -> None:
        """Wait until everything has been sent."""
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


def _free_port(usual: int) -> int:
    """The usual port, or any free one where it is taken: rerun only logs that it could not listen."""
    for port in (usual, 0):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("", port))
            except OSError:
                continue
            return int(probe.getsockname()[1])
    raise InputError("the viewer cannot be served: no network port is free")


def _rerun() -> Any:
    try:
        return importlib.import_module("rerun")
    except ImportError as error:
        raise MissingExtraError("the interactive viewer", "view") from error
