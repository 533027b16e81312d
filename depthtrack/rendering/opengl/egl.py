"""EGL contexts without a surface, on a GPU or on Mesa's software renderer.

Displays are never terminated: two requests may share a display, and its end would end the contexts of both.
"""

import ctypes
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from depthtrack.rendering.opengl.context import INSTALL, Binding, Context, Device, OpenGLError

_PLATFORM_DEVICE = 0x313F  # EGL_PLATFORM_DEVICE_EXT
_PLATFORM_SURFACELESS = 0x31DD  # EGL_PLATFORM_SURFACELESS_MESA
_DRM_DEVICE_FILE = 0x3233  # EGL_DRM_DEVICE_FILE_EXT
_CORE_3_3 = (0x3098, 3, 0x30FB, 3, 0x30FD, 1)  # EGL_CONTEXT_MAJOR_VERSION, _MINOR_VERSION, core profile
_MAX_DEVICES = 64


class Egl(NamedTuple):
    """PyOpenGL's EGL modules: core, device enumeration, and displays by platform."""

    core: Any
    devices: Any
    displays: Any


@dataclass(frozen=True)
class EglDevice:
    """An EGL device and its index in EGL's list; `software` is reported by the device."""

    index: int
    description: str
    software: bool
    handle: Any = field(repr=False, compare=False)


class EglBinding:
    """An OpenGL 3.3 core context on an initialised display.

    Raises:
        OpenGLError: if the display gives no such context.
        EGLError: of PyOpenGL, if EGL rejects a call.
    """

    def __init__(self, egl: Egl, display: Any) -> None:
        self._egl, self._display = egl.core, display
        egl.core.eglBindAPI(egl.core.EGL_OPENGL_API)
        attributes = (egl.core.EGLint * 7)(*_CORE_3_3, egl.core.EGL_NONE)
        self._context = egl.core.eglCreateContext(display, _config(egl, display), None, attributes)
        if not self._context:
            raise OpenGLError("no OpenGL 3.3 core context")

    def bind(self) -> None:
        egl = self._egl
        egl.eglBindAPI(egl.EGL_OPENGL_API)
        self._before = (
            egl.eglGetCurrentDisplay(),
            egl.eglGetCurrentSurface(egl.EGL_DRAW),
            egl.eglGetCurrentSurface(egl.EGL_READ),
            egl.eglGetCurrentContext(),
        )
        if not egl.eglMakeCurrent(self._display, egl.EGL_NO_SURFACE, egl.EGL_NO_SURFACE, self._context):
            raise OpenGLError("EGL cannot make its context current")

    def unbind(self) -> None:
        egl, (display, draw, read, context) = self._egl, self._before
        if context:
            egl.eglMakeCurrent(display, draw, read, context)
        else:
            egl.eglMakeCurrent(self._display, egl.EGL_NO_SURFACE, egl.EGL_NO_SURFACE, egl.EGL_NO_CONTEXT)

    def destroy(self) -> None:
        self._egl.eglDestroyContext(self._display, self._context)


def open_egl(egl: Egl, device: Device, context_of: Callable[[Binding], Context]) -> Context:
    """Return the first context that works on `device`; see `opening.open_context`.

    A missing vendor driver falls back to software silently, so the kind of device is checked on the renderer.

    Raises:
        OpenGLError: if no display gives a context on such a device; it lists the displays tried.
    """
    found = []
    for name, open_display in _displays(egl, device):
        try:
            display = open_display()
            if not display or not egl.core.eglInitialize(display, None, None):
                found.append(f"{name}: no display")
                continue
            context = context_of(EglBinding(egl, display))
        except (OpenGLError, egl.core.EGLError) as error:
            found.append(f"{name}: {_reason(error)}")
            continue
        if device not in ("gpu", "software") or context.software == (device == "software"):
            return context
        found.append(f"{name}: {context.renderer}")
        context.close()
    missing = {"gpu": "finds no GPU", "software": "finds no software renderer"}.get(str(device), "gives no OpenGL 3.3")
    remedy = "a GPU needs its vendor's EGL driver" if device == "gpu" else f"run  {INSTALL['egl']}"
    raise OpenGLError(f"EGL {missing}; tried {', '.join(found) or 'nothing, since it lists no device'}: {remedy}")


def list_devices(egl: Egl) -> list[EglDevice]:
    """Return all EGL devices; none if EGL cannot list them."""
    core, query = egl.core, egl.devices
    if "EGL_EXT_device_base" not in _names(egl) and "EGL_EXT_device_enumeration" not in _names(egl):
        return []
    handles, count = (query._types.EGLDeviceEXT * _MAX_DEVICES)(), core.EGLint()
    try:
        if not query.eglQueryDevicesEXT(_MAX_DEVICES, handles, count):
            return []
    except core.EGLError:
        return []
    return [_described(egl, index, handles[index]) for index in range(count.value)]


def _described(egl: Egl, index: int, handle: Any) -> EglDevice:
    def query(attribute: int) -> str:
        try:
            return (egl.devices.eglQueryDeviceStringEXT(handle, attribute) or b"").decode(errors="replace")
        except egl.core.EGLError:
            return ""

    extensions = query(egl.core.EGL_EXTENSIONS)
    software = "EGL_MESA_device_software" in extensions
    file = query(_DRM_DEVICE_FILE) if "EGL_EXT_device_drm" in extensions.split() else ""
    description = "software" if software else file or extensions or "unnamed"
    return EglDevice(index, description, software, handle)


def _displays(egl: Egl, device: Device) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Yield the displays to try for a device, in order: its name and the function that opens it."""
    devices = list_devices(egl)
    if isinstance(device, int):
        if not 0 <= device < len(devices):
            listed = ", ".join(f"{d.index} ({d.description})" for d in devices) or "none"
            raise OpenGLError(f"EGL has no device {device}: choose one of {listed}")
        chosen = [devices[device]]
    else:
        chosen = [d for d in devices if not d.software] if device != "software" else []
    for d in chosen:
        yield f"device {d.index} ({d.description})", lambda d=d: _display(egl, _PLATFORM_DEVICE, d.handle)  # type: ignore[misc]
    if isinstance(device, int):
        return
    if "EGL_MESA_platform_surfaceless" in _names(egl):
        yield "surfaceless", lambda: _display(egl, _PLATFORM_SURFACELESS, None)
    for d in devices if device != "gpu" else []:
        if d.software:
            yield f"device {d.index} (software)", lambda d=d: _display(egl, _PLATFORM_DEVICE, d.handle)  # type: ignore[misc]
    yield "default display", lambda: egl.core.eglGetDisplay(egl.core.EGL_DEFAULT_DISPLAY)


def _display(egl: Egl, platform: int, native: Any) -> Any:
    return egl.displays.eglGetPlatformDisplayEXT(platform, native, None)


def _names(egl: Egl) -> list[str]:
    """Return the client extensions, which exist before a display is opened."""
    try:
        return (egl.core.eglQueryString(egl.core.EGL_NO_DISPLAY, egl.core.EGL_EXTENSIONS) or b"").decode().split()
    except egl.core.EGLError:
        return []


def _config(egl: Egl, display: Any) -> Any:
    """Return a configuration for drawing into textures only; None if EGL needs none."""
    core = egl.core
    if "EGL_KHR_no_config_context" in core.eglQueryString(display, core.EGL_EXTENSIONS).decode().split():
        return None
    wanted = (core.EGLint * 5)(
        core.EGL_SURFACE_TYPE, core.EGL_PBUFFER_BIT, core.EGL_RENDERABLE_TYPE, core.EGL_OPENGL_BIT, core.EGL_NONE
    )
    config, count = (core.EGLConfig * 1)(), core.EGLint()
    if not core.eglChooseConfig(display, wanted, config, 1, ctypes.byref(count)) or count.value < 1:
        raise OpenGLError("no configuration with OpenGL")
    return config[0]


def _reason(error: Exception) -> str:
    return str(error) if isinstance(error, OpenGLError) else str(getattr(error, "err", error)).split(" (")[0]
