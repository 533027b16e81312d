"""Libraries that are installed but cannot be imported, and the commands that mend them."""

from importlib import import_module
from types import TracebackType

LIBRARIES = {
    "numpy": "numpy",
    "scipy": "scipy",
    "numba": "numba",
    "deflate": "deflate",
    "cv2": "opencv-python-headless",
    "OpenGL": "PyOpenGL",
    "trimesh": "trimesh",
    "tyro": "tyro",
    "tqdm": "tqdm",
    "matplotlib": "matplotlib",
    "PIL": "pillow",
    "joblib": "joblib",
    "jinja2": "jinja2",
    "pydantic": "pydantic",
}
"""Required modules, and the packages that contain them."""


def broken_imports() -> dict[str, str]:
    """Return the reason why each required module that cannot be imported fails."""
    found = {}
    for module in LIBRARIES:
        try:
            import_module(module)
        except ImportError as error:
            found[module] = str(error)
    return found


def failed_module(error: ImportError) -> str | None:
    """Return the required module whose import failed; None if it is none of them."""
    named = (error.name or "").partition(".")[0]
    if named in LIBRARIES:
        return named
    raised_in = _modules(error.__traceback__)
    return raised_in[-1] if raised_in else None


def advice(module: str, reason: str) -> str:
    """Return one sentence: the module, the reason, and the commands that install it again."""
    package = LIBRARIES[module]
    command = f"pip install --force-reinstall {package}"
    if module == "cv2":
        # Two packages with the same files: removing one breaks the other.
        command = f"pip uninstall -y opencv-python opencv-contrib-python {package}; pip install {package}"
    return f"{module} cannot be imported ({reason}): run  {command}"


def _modules(trace: TracebackType | None) -> list[str]:
    """Return the required modules whose code a traceback passes through, outermost first."""
    found = []
    while trace is not None:
        name = str(trace.tb_frame.f_globals.get("__name__", "")).partition(".")[0]
        if name in LIBRARIES:
            found.append(name)
        trace = trace.tb_next
    return found
