"""Compilation of kernels, and the folder that holds the compiled code between runs.

numba keeps compiled code beside each source file, and compares that file alone. Code then outlives a change of the
functions and types that a kernel uses, a file that was cut short ends each later start, and a machine without a
writable folder cannot import the kernels. The cache here compares all sources that a kernel imports. It compiles again
what it cannot read, and does without a folder.
"""

import gc
import hashlib
import os
import re
import sys
import tempfile
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numba
from numba.core import caching, config, event
from numba.core.runtime import rtsys

from depthtrack.errors import DepthtrackError

VARIABLE = "NUMBA_CACHE_DIR"
"""Environment variable that names the folder for compiled code."""
TOO_NEW = (0, 69)
"""First version of numba whose internals were not tried with the cache here and `simd`; pyproject.toml has the same."""
_PACKAGE = Path(__file__).parent
_IMPORT = re.compile(rb"^\s*(?:from|import)\s+(depthtrack[\w.]*)(?:\s+import\s+(?:\(([^)]*)\)|(.*)))?", re.MULTILINE)


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles a function of a module on its first call.

    A kernel that Python calls must return plain numbers, arrays and tuples of them. numba calls Python to make an
    object of a class, such as a NamedTuple, and does not check the result. A signal that is handled there raises an
    error, and the process crashes.

    options: those of `numba.njit`; the kernel lets other threads run. Functions with equal options share the code that
        numba makes of its own functions.

    Raises:
        DepthtrackError: if the environment turns the compiler off, or numba is newer than tried.
    """
    check_numba(numba.__version__)
    if config.DISABLE_JIT:
        raise DepthtrackError("the kernels need numba's compiler: unset the environment variable NUMBA_DISABLE_JIT")

    def compile_lazily(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(no_cfunc_wrapper=True, **{"nogil": True, **options})(function)  # C code calls no kernel
        if cache_folder() is not None:
            dispatcher._cache = KernelCache(function)
        return dispatcher

    return compile_lazily


def check_numba(version: str) -> None:
    """Check that the internals of numba are those that this program relies on.

    Raises:
        DepthtrackError: if the version is too new.
    """
    parts = tuple(int(part) for part in re.findall(r"\d+", version)[:2])
    if parts >= TOO_NEW:
        bound = ".".join(map(str, TOO_NEW))
        raise DepthtrackError(f"numba must be older than {bound}, found {version}: run  pip install 'numba<{bound}'")


class _GarbagePause(event.Listener):  # type: ignore[misc]
    """Pauses the garbage collector while kernels compile, which takes a sixth less time.

    Compilation keeps most of its many objects. numba compiles in one thread at a time.
    """

    def __init__(self) -> None:
        self._depth, self._was_enabled = 0, False

    def on_start(self, event: event.Event) -> None:
        if self._depth == 0:
            self._was_enabled = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event: event.Event) -> None:
        self._depth -= 1
        if self._depth == 0 and self._was_enabled:
            gc.enable()


event.register("numba:compile", _GarbagePause())


@cache
def cache_folder() -> Path | None:
    """Return the folder for compiled code, or None if none is writable.

    It is that of `VARIABLE`, or `__pycache__` of the package, or the user's folder for caches, or a private
    temporary folder. Others must not write to it, because numba unpickles the files.
    """
    chosen = [Path(config.CACHE_DIR)] if config.CACHE_DIR else [_PACKAGE / "__pycache__", *_user_caches()]
    private = Path(tempfile.gettempdir()) / f"depthtrack-{os.getuid() if hasattr(os, 'getuid') else 'cache'}"
    for folder in (*chosen, private):
        path = folder / f"kernels-{sys.implementation.cache_tag}"
        if _is_usable(path):
            return path
    warnings.warn(f"compiled kernels are not kept, because no folder is writable: set {VARIABLE}", stacklevel=1)
    return None


def _user_caches() -> list[Path]:
    """Return our folder among the caches of this user, as the system defines it; none of a user without a home."""
    try:
        if sys.platform == "win32":
            found = Path(os.environ.get("LOCALAPPDATA") or Path.home())
        elif sys.platform == "darwin":
            found = Path("~/Library/Caches").expanduser()
        else:
            found = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser()
    except RuntimeError:
        return []
    return [found / "depthtrack"]


def _is_usable(folder: Path) -> bool:
    """Return whether files can be written to a folder that belongs to this user alone; make it if absent."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if hasattr(os, "getuid") and folder.parent.stat().st_uid not in (os.getuid(), 0):
            return False
        tempfile.TemporaryFile(dir=folder).close()
    except (OSError, RuntimeError):
        return False
    return True


@cache
def source_digest(file: Path) -> str:
    """Return the SHA-256 of the sources that the compiled code of a file depends on."""
    digest = hashlib.sha256()
    for path in sorted(sources_of(file)):
        digest.update(path.name.encode() + b"\0" + _source(path) + b"\0")
    return digest.hexdigest()


def sources_of(file: Path) -> set[Path]:
    """Return a file and the files of the package that it imports, directly or not."""
    found, waiting = {file}, [file]
    while waiting:
        new = _imported(waiting.pop()) - found
        found |= new
        waiting += new
    return found


@cache
def _source(file: Path) -> bytes:
    return file.read_bytes()


@cache
def _imported(file: Path) -> set[Path]:
    """Return the files of the package that a file names in its import statements."""
    modules = set()
    for match in _IMPORT.finditer(_source(file)):
        module, names = match[1].decode(), (match[2] or match[3] or b"").decode()
        modules |= {module, *(f"{module}.{name.split()[0]}" for name in names.split(",") if name.split())}
    paths = (_PACKAGE.parent.joinpath(*module.split(".")) for module in modules)
    return {file for path in paths for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()}


class _Locator(caching._CacheLocator):  # type: ignore[misc]
    """Place and validity of the compiled code of one function."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._py_file, self._line = file, function.__code__.co_firstlineno

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> "_Locator":
        return cls(py_func, py_file)

    def get_cache_path(self) -> str:
        return str(cache_folder())

    def get_source_stamp(self) -> str:
        return source_digest(Path(self._py_file))

    def get_disambiguator(self) -> str:
        return f"{hashlib.sha256(self._py_file.encode()).hexdigest()[:8]}-{self._line}"


class _Code(caching.CompileResultCacheImpl):  # type: ignore[misc]
    """Compiled code of one function, in the folder of `cache_folder`."""

    _locator_classes: ClassVar = [_Locator]


class _Files(caching.IndexDataCacheFile):  # type: ignore[misc]
    """Files of one kernel, to which several processes may write.

    numba numbers the files of the signatures, so that two processes may give one name to two of them.
    """

    def save(self, key: Any, data: Any) -> None:
        """Save the compiled code of a signature, under a name that no other signature has."""
        name = self._data_name_pattern.replace("{number:d}", hashlib.sha256(repr(key).encode()).hexdigest()[:12])
        self._save_data(name, data)
        self._save_index({**self._load_index(), key: name})


class KernelCache(caching.FunctionCache):  # type: ignore[misc]
    """Cache of one kernel that is never a reason to fail."""

    _impl_class = _Code

    @staticmethod
    def is_part(function: Callable[..., Any], types: Any) -> bool:
        """Return whether code of these types lacks an entry from Python; `ahead_compiler` makes such code."""
        return False

    @staticmethod
    def wait_for(function: Callable[..., Any], types: Any) -> bool:
        """Wait until another process has compiled code of these types; return whether one does.

        `precompilation` sets it.
        """
        return False

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        locator = self._impl.locator
        self._cache_file = _Files(locator.get_cache_path(), self._impl.filename_base, locator.get_source_stamp())

    def keeps(self, sig: Any, target_context: Any) -> bool:
        """Return whether the compiled code of a signature is kept."""
        try:
            return self._index_key(sig, target_context.codegen()) in self._cache_file._load_index()
        except Exception:  # as in load_overload
            return False

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled code of a signature, or None if there is none that can be read.

        numba would load the implementations of all its functions before, which compilation alone needs: 0.2 s.
        """
        rtsys.initialize(target_context)
        found = self._loaded(sig, target_context)
        return self._loaded(sig, target_context) if found is None and self.wait_for(self._py_func, sig) else found

    def _loaded(self, sig: Any, target_context: Any) -> Any:
        try:
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)
        except Exception:  # a damaged pickle raises errors of any kind
            self._discard()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save the compiled code of a signature, unless the folder cannot be written any more."""
        try:
            super().save_overload(sig, data)
        except Exception:
            self._discard()

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        key = super()._index_key(sig, codegen)
        return (*key, "part") if self.is_part(self._py_func, sig) else key

    def _discard(self) -> None:
        try:
            self.flush()
        except OSError:
            self.disable()
