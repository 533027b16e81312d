"""OSMesa contexts: Mesa's software renderer in plain memory, without driver and display."""

import ctypes
from typing import Any

from depthtrack.rendering.opengl.context import OpenGLError

_SIDE = 4
"""Pixels of the framebuffer that OSMesa requires; all drawing goes to textures instead."""


class OSMesaBinding:
    """An OpenGL 3.3 core context.

    Raises:
        OpenGLError: if OSMesa gives no such context.
    """

    def __init__(self, osmesa: Any, gl: Any) -> None:
        self._osmesa, self._type = osmesa, gl.GL_UNSIGNED_BYTE
        self._state = (ctypes.c_ubyte * (4 * _SIDE * _SIDE))()
        attributes = (
            *(osmesa.OSMESA_FORMAT, osmesa.OSMESA_RGBA),
            *(osmesa.OSMESA_PROFILE, osmesa.OSMESA_CORE_PROFILE),
            *(osmesa.OSMESA_CONTEXT_MAJOR_VERSION, 3, osmesa.OSMESA_CONTEXT_MINOR_VERSION, 3, 0),
        )
        self._context = osmesa.OSMesaCreateContextAttribs((ctypes.c_int * len(attributes))(*attributes), None)
        if not self._context:
            raise OpenGLError("OSMesa gives no OpenGL 3.3 core context: install a newer libosmesa6")

    def bind(self) -> None:
        if not self._osmesa.OSMesaMakeCurrent(self._context, self._state, self._type, _SIDE, _SIDE):
            raise OpenGLError("OSMesa cannot make its context current")

    def unbind(self) -> None:
        self._osmesa.OSMesaMakeCurrent(None, None, self._type, 0, 0)

    def destroy(self) -> None:
        self._osmesa.OSMesaDestroyContext(self._context)
