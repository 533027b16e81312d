"""Programs compiled from the GLSL files of `shaders/`."""

from typing import Any

from depthtrack.rendering.opengl.context import OpenGLError
from depthtrack.resources import resource_folder


class Program:
    """A linked vertex and fragment shader of the current context.

    Raises:
        OpenGLError: if the driver rejects a shader or the program; it quotes the driver's message.
    """

    def __init__(self, gl: Any, vertex: str, fragment: str) -> None:
        """Compile `shaders/<vertex>` and `shaders/<fragment>`."""
        self._gl, self._name = gl, gl.glCreateProgram()
        for kind, file in ((gl.GL_VERTEX_SHADER, vertex), (gl.GL_FRAGMENT_SHADER, fragment)):
            shader = gl.glCreateShader(kind)
            gl.glShaderSource(shader, (resource_folder("shaders") / file).read_text(encoding="utf-8"))
            gl.glCompileShader(shader)
            if not gl.glGetShaderiv(shader, gl.GL_COMPILE_STATUS):
                raise OpenGLError(f"the driver rejects shaders/{file}: {_text(gl.glGetShaderInfoLog(shader))}")
            gl.glAttachShader(self._name, shader)
            gl.glDeleteShader(shader)  # takes effect when the program is deleted
        gl.glLinkProgram(self._name)
        if not gl.glGetProgramiv(self._name, gl.GL_LINK_STATUS):
            raise OpenGLError(
                f"the driver cannot link {vertex} with {fragment}: {_text(gl.glGetProgramInfoLog(self._name))}"
            )
        self._uniforms: dict[str, int] = {}

    def use(self, **uniforms: float | int | tuple[int, int]) -> None:
        """Make the program current and set its uniforms: float, int (texture unit) or two ints."""
        gl = self._gl
        gl.glUseProgram(self._name)
        for name, value in uniforms.items():
            if name not in self._uniforms:
                self._uniforms[name] = gl.glGetUniformLocation(self._name, name)
            location = self._uniforms[name]
            if isinstance(value, tuple):
                gl.glUniform2i(location, *value)
            elif isinstance(value, int):
                gl.glUniform1i(location, value)
            else:
                gl.glUniform1f(location, value)


def _text(log: bytes | str) -> str:
    return (log.decode(errors="replace") if isinstance(log, bytes) else log).strip()
