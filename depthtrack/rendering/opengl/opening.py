"""Opening of OpenGL contexts; the only module that imports PyOpenGL.

PyOpenGL binds itself to one platform at its first import, by an environment variable. So a process can use EGL or
OSMesa but not both, and no other module may import PyOpenGL.
"""

import ctypes
import os
import sys
import threading
from importlib import import_module
from typing import Any

from depthtrack.rendering.opengl.context import FORKED, INSTALL, Context, Device, OpenGLError, Platform

_VARIABLE = "PYOPENGL_PLATFORM"
_LIBRARIES: dict[Platform, tuple[tuple[str, ...], ...]] = {
    # Each group is satisfied by any one of its names.
    "egl": (("libEGL.so.1",), ("libOpenGL.so.0", "libGL.so.1")),
    "osmesa": (("libOSMesa.so.8", "libOSMesa.so.6"),),
}
_MODULES: dict[Platform, tuple[str, ...]] = {
    # The platform's own module first, as PyOpenGL wants it, and GL last.
    "egl": ("OpenGL.EGL", "OpenGL.EGL.EXT.device_base", "OpenGL.EGL.EXT.platform_base", "OpenGL.GL"),
    "osmesa": ("OpenGL.osmesa", "OpenGL.GL"),
}


def open_context(platform: Platform, device: Device = None) -> Context:
    """Return a new context, released by `close` or at the end of the process.

    device: "gpu", "software", an index into `egl.list_devices` (EGL only), or None for a GPU if there is one.

    Raises:
        OpenGLError: if there is no context; it names the package to install, the displays tried, or the platform in
            use.
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
"""ID of the process that loaded OpenGL."""


def load(platform: Platform) -> list[Any]:
    """Return PyOpenGL's modules of a platform, in the order of `_MODULES`.

    Raises:
        OpenGLError: if a library is missing, another platform is in use, or the process was forked.
    """
    global _loaded_in
    with _load_lock:
        if _loaded_in not in (None, os.getpid()):
            raise OpenGLError(FORKED)
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
            # A child process may choose another platform.
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
                f"run {platform} in a separate process"
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
