"""OpenGL without a window: the one module that imports PyOpenGL, and the contexts it opens.

PyOpenGL binds itself to one platform at its first import, by an environment variable, so a process can use EGL or
OSMesa but not both, and nothing else here may import it.
"""

import atexit
import ctypes
import os
import sys
import threading
from importlib import import_module
from types import TracebackType
from typing import Any, Literal, Protocol

from depthtrack.errors import DepthtrackError

Platform = Literal["egl", "osmesa"]
Device = Literal["gpu", "software"] | int | None

_VARIABLE = "PYOPENGL_PLATFORM"
_LIBRARIES: dict[Platform, tuple[tuple[str, ...], ...]] = {
    # Each group is satisfied by any one of its names.
    "egl": (("libEGL.so.1",), ("libOpenGL.so.0", "libGL.so.1")),
    "osmesa": (("libOSMesa.so.8", "libOSMesa.so.6"),),
}
INSTALL: dict[Platform, str] = {
    "egl": "apt-get install libegl1 libgl1-mesa-dri libopengl0  (Debian, Ubuntu)",
    "osmesa": "apt-get install libosmesa6  (Debian, Ubuntu; gone from Mesa 25.1 on, where egl is the one that lasts)",
}
_MODULES: dict[Platform, tuple[str, ...]] = {
    # The platform's own module first, as PyOpenGL wants it, and GL last.
    "egl": ("OpenGL.EGL", "OpenGL.EGL.EXT.device_base", "OpenGL.EGL.EXT.platform_base", "OpenGL.GL"),
    "osmesa": ("OpenGL.osmesa", "OpenGL.GL"),
}
_FORKED = (
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
            raise OpenGLError(_FORKED)

    def _require_open(self) -> None:
        if self.closed:
            raise OpenGLError("this OpenGL context was released: create a new scorer")


def open_context(platform: Platform, device: Device = None) -> Context:
    """A new context, released by `close` or when the process ends.

    `device` (EGL only): "gpu", "software", an index into `egl.list_devices`, or None for a GPU where there is one and
    software otherwise. Raises OpenGLError naming the package to install, what was tried, or the platform in use.
    """
    if platform == "osmesa":
        if device not in (None, "software"):
            raise OpenGLError(f"osmesa draws in software only, found device {device!r}: use egl for a GPU")
        from depthtrack.rendering.opengl.osmesa import OSMesaBinding

        osmesa, gl = load("osmesa")
        return Context(gl, OSMesaBinding(osmesa, gl))
    from depthtrack.rendering.opengl.egl import Egl, open_egl

    *modules, gl = load("egl")
    return open_egl(Egl(*modules), device, lambda binding: Context(gl, binding))


_load_lock = threading.Lock()
_loaded_in: int | None = None
"""The process that loaded OpenGL."""


def load(platform: Platform) -> list[Any]:
    """PyOpenGL's modules for a platform, as `_MODULES` lists them. Raises OpenGLError when that cannot be."""
    global _loaded_in
    with _load_lock:
        if _loaded_in not in (None, os.getpid()):
            raise OpenGLError(_FORKED)
        _refuse_contradictions(platform)
        _require_libraries(platform)
        before = os.environ.get(_VARIABLE)
        os.environ[_VARIABLE] = platform
        try:
            modules = [import_module(name) for name in _MODULES[platform]]
        except ModuleNotFoundError as error:
            raise OpenGLError("OpenGL needs PyOpenGL: run  pip install 'PyOpenGL>=3.1.10'") from error
        except (ImportError, AttributeError, OSError, TypeError) as error:
            raise OpenGLError(f"PyOpenGL cannot load {platform} ({error}): run  {INSTALL[platform]}") from error
        finally:
            # Child processes choose for themselves.
            if before is None:
                del os.environ[_VARIABLE]
            else:
                os.environ[_VARIABLE] = before
        _loaded_in = os.getpid()
        return modules


def _refuse_contradictions(platform: Platform) -> None:
    if "OpenGL.platform" in sys.modules:
        bound = type(sys.modules["OpenGL.platform"].PLATFORM).__name__.removesuffix("Platform").lower()
        if bound != platform:
            raise OpenGLError(
                f"this process already uses OpenGL through {bound}, and PyOpenGL allows one platform a process: "
                f"run {platform} in a process of its own"
            )
    elif os.environ.get(_VARIABLE, platform) != platform:
        raise OpenGLError(
            f"{_VARIABLE}={os.environ[_VARIABLE]} contradicts the {platform} backend: unset it, or set it to {platform}"
        )


def _require_libraries(platform: Platform) -> None:
    for names in _LIBRARIES[platform]:
        if not any(_loads(name) for name in names):
            raise OpenGLError(f"the library {names[0]} is missing: run  {INSTALL[platform]}")


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _text(value: bytes | None) -> str:
    return "unknown" if value is None else value.decode(errors="replace")
