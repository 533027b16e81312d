"""The kernels that trackers, searches for layouts and calibration call, with the types of their arguments.

`kernels.json` lists them; tools/generate_kernels.py writes it.
"""

import re
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from numba import types

from depthtrack.compilation import cache_folder
from depthtrack.strict_data import parse_json

LIST = Path(__file__).with_name("kernels.json")
_ARRAY = re.compile(r"(\w+)\[(\d)([ACF])\]( readonly)?")


class Kernel(NamedTuple):
    """A compiled function and the types of its arguments.

    arguments: a text for a scalar or an array, a list for a tuple, a dictionary with one key for a named tuple.
    seconds: time to compile it, for the order alone.
    """

    module: str
    name: str
    arguments: list[Any]
    seconds: float

    @property
    def dispatcher(self) -> Any:
        """The function as numba sees it."""
        return getattr(import_module(self.module), self.name)

    @property
    def signature(self) -> tuple[types.Type, ...]:
        """Numba types of the arguments."""
        return tuple(map(type_of, self.arguments))

    @property
    def is_kept(self) -> bool:
        """Whether the folder for compiled code has it."""
        dispatcher = self.dispatcher
        return bool(dispatcher._cache.keeps(self.signature, dispatcher.targetctx))


def listed_kernels() -> list[Kernel]:
    """Return the kernels of the list, those that take longest first."""
    return [Kernel(**entry) for entry in parse_json(LIST.read_text(encoding="utf-8"))]


def type_of(text: Any) -> types.Type:
    """Return the numba type that a description of `kernels.json` names.

    Raises:
        ValueError: if it describes none.
    """
    if isinstance(text, list):
        return types.BaseTuple.from_types([type_of(each) for each in text])
    if isinstance(text, dict):
        ((name, members),) = text.items()
        module, _, attribute = name.rpartition(".")
        named = getattr(import_module(module), attribute)
        return types.BaseTuple.from_types([type_of(each) for each in members], named)
    if match := _ARRAY.fullmatch(text):
        return types.Array(type_of(match[1]), int(match[2]), match[3], readonly=match[4] is not None)
    scalar = getattr(types, text, None)
    if not isinstance(scalar, types.Number | types.Boolean):
        raise ValueError(f"no type is named {text!r}")
    return scalar


def text_of(found: types.Type) -> Any:
    """Return the description of a numba type, from which `type_of` makes it.

    Raises:
        ValueError: if `kernels.json` has no description of such types.
    """
    if isinstance(found, types.BaseNamedTuple):
        members = found.types if isinstance(found, types.NamedTuple) else [found.dtype] * found.count
        name = f"{found.instance_class.__module__}.{found.instance_class.__qualname__}"
        return {name: [text_of(each) for each in members]}
    if isinstance(found, types.BaseTuple):
        return [text_of(each) for each in found]
    if isinstance(found, types.Array):
        return f"{text_of(found.dtype)}[{found.ndim}{found.layout}]" + ("" if found.mutable else " readonly")
    if not isinstance(found, types.Number | types.Boolean):
        raise ValueError(f"a kernel takes {found}: extend kernel_list.text_of")
    return "boolean" if found == types.boolean else str(found)


def absent_kernels(kernels: Sequence[Kernel]) -> list[Kernel]:
    """Return the kernels that the folder for compiled code lacks; none without a folder."""
    return [] if cache_folder() is None else [kernel for kernel in kernels if not kernel.is_kept]
