"""An OpenGL context without a window, current inside `with` and shared between threads."""

import atexit
import os
import threading
from types import TracebackType
from typing import Any, Literal, Protocol

from depthtrack.errors import DepthtrackError

Platform = Literal["egl", "osmesa"]
Device = Literal["gpu", "software"] | int | None

INSTALL: dict[Platform, str] = {
    "egl": "apt-get install libegl1 libgl1-mesa-dri libopengl0  (Debian, Ubuntu)",
    "osmesa": "apt-get install libosmesa6  (Debian, Ubuntu; removed from Mesa 25.1 on: use egl there)",
}
FORKED = (
    "OpenGL was in use before this process was forked, and drivers do not survive a fork: use multiprocessing's 'spawn'"
)
_SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "swr ", "software")


class OpenGLError(DepthtrackError):
    """OpenGL is unusable here; the message names what is missing and how to install it."""


class Binding(Protocol):
    """The context of a platform."""

    def bind(self) -> None:
        """Make the context current in the calling thread."""
        ...

    def unbind(self) -> None:
        """Restore the context that was current before."""
        ...

    def destroy(self) -> None:
        """Destroy the context."""
        ...


class Context:
    """An OpenGL 3.3 core context, current only inside `with context as gl:`.

    renderer, version: the driver's own description.
    software: whether the renderer runs on the CPU.
    max_side: largest side of a texture, pixels.

    Threads take turns.

    Raises:
        OpenGLError: if it is used in a forked child or after `close`.
    """

    def __init__(self, gl: Any, binding: Binding) -> None:
        self._gl, self._binding = gl, binding
        self._lock, self._depth, self._process = threading.RLock(), 0, os.getpid()
        self._discarded: list[int] = []
        self.closed = False
        self.renderer = "OpenGL"
        with self:
            self.renderer = _text(gl.glGetString(gl.GL_RENDERER))
            self.version = _text(gl.glGetString(gl.GL_VERSION))
            self.max_side = int(gl.glGetIntegerv(gl.GL_MAX_TEXTURE_SIZE))
        self.software = any(name in self.renderer.lower() for name in _SOFTWARE_RENDERERS)
        atexit.register(self.close)

    def __enter__(self) -> Any:
        self.require_own_process()
        self._lock.acquire()
        if self._depth == 0:
            try:
                self._require_open()
                self._binding.bind()
            except BaseException:
                self._lock.release()
                raise
            while self._discarded:
                self._gl.glDeleteTextures(1, [self._discarded.pop()])
        self._depth += 1
        return self._gl

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._depth -= 1
        if self._depth == 0:
            self._binding.unbind()
        self._lock.release()
        if isinstance(error, self._gl.GLError):
            is_full = error.err == self._gl.GL_OUT_OF_MEMORY
            problem = "is out of memory: reduce the region" if is_full else f"failed with OpenGL error {error.err}"
            raise OpenGLError(f"{self.renderer} {problem}") from error

    def discard_texture(self, name: int) -> None:
        """Delete a texture when the context is next current; any thread or destructor may call it."""
        self._discarded.append(name)

    def close(self) -> None:
        """Destroy the context and its objects; do nothing in a forked child, where that would hang."""
        if self._process == os.getpid() and not self.closed:
            with self._lock:
                self.closed = True
                self._binding.destroy()
                atexit.unregister(self.close)

    def require_own_process(self) -> None:
        """Check that the process is the one that opened the context.

        Raises:
            OpenGLError: in a forked child.
        """
        if self._process != os.getpid():
            raise OpenGLError(FORKED)

    def _require_open(self) -> None:
        if self.closed:
            raise OpenGLError("this OpenGL context was released: create a new scorer")


def _text(value: bytes | None) -> str:
    return "unknown" if value is None else value.decode(errors="replace")
