"""An OpenGL context without a window, whatever platform gave it: current inside `with`, shared by turns, released."""

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
    "osmesa": "apt-get install libosmesa6  (Debian, Ubuntu; gone from Mesa 25.1 on, where egl is the one that lasts)",
}
FORKED = (
    "OpenGL was in use before this process was forked, and drivers do not survive a fork: use multiprocessing's 'spawn'"
)
_SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "swr ", "software")


class OpenGLError(DepthtrackError):
    """OpenGL cannot be used here; the message says what is missing and how to get it."""


class Binding(Protocol):
    """A platform's context: how to make it the calling thread's current one, and how to end it."""

    def bind(self) -> None: ...

    def unbind(self) -> None:
        """Put back whatever was current before."""
        ...

    def destroy(self) -> None: ...


class Context:
    """An OpenGL 3.3 core context. Inside `with context as gl:` it is current, and only there.

    `renderer` and `version` are what the driver says of itself; `software` tells that no GPU is behind it.
    Threads take turns. Forked children are refused: drivers do not survive a fork.
    """

    def __init__(self, gl: Any, binding: Binding) -> None:
        self._gl, self._binding = gl, binding
        self._lock, self._depth, self._process = threading.RLock(), 0, os.getpid()
        self._doomed: list[int] = []
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
            while self._doomed:
                self._gl.glDeleteTextures(1, [self._doomed.pop()])
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
            what = "is out of memory: reduce the region" if is_full else f"failed with OpenGL error {error.err}"
            raise OpenGLError(f"{self.renderer} {what}") from error

    def discard_texture(self, name: int) -> None:
        """Delete a texture when the context is next current: safe from any thread and from a destructor."""
        self._doomed.append(name)

    def close(self) -> None:
        """End the context and all that lives in it. In a forked child, where that would hang, nothing happens."""
        if self._process == os.getpid() and not self.closed:
            with self._lock:
                self.closed = True
                self._binding.destroy()
                atexit.unregister(self.close)

    def require_own_process(self) -> None:
        """Raise OpenGLError in a forked child."""
        if self._process != os.getpid():
            raise OpenGLError(FORKED)

    def _require_open(self) -> None:
        if self.closed:
            raise OpenGLError("this OpenGL context was released: create a new scorer")


def _text(value: bytes | None) -> str:
    return "unknown" if value is None else value.decode(errors="replace")
