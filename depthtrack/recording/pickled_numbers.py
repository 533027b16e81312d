"""Numbers and arrays of a pickle, read without unpickling: no code of the file runs.

HO-3D stores its annotations as pickles. This reader interprets the opcodes that dictionaries, lists, numbers, text
and NumPy arrays of numbers need. A reference to any other function is a mark that cannot be called.
"""

import pickletools
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import read_bounded

_MOST_OPCODES = 1_000_000
_KINDS = "biufSU"
"""Kinds of NumPy types that are numbers or text."""


@dataclass(frozen=True)
class _Name:
    """A reference to a function or class, by its full name."""

    name: str


@dataclass
class _Call:
    """A call that stays unexecuted; `state` is what BUILD passes to its result."""

    function: Any
    arguments: Any
    state: Any = field(default=None)


class _Mark:
    """The mark on the stack."""


def read_pickled_numbers(path: Path, largest: int = 1 << 24) -> Mapping[str, Any]:
    """Return the entries of a pickled dictionary.

    Arrays are NumPy arrays. What is no number, text or list of them is None.

    Raises:
        InputError: if the file is missing, longer than `largest` bytes, damaged, or holds no dictionary.
    """
    data = read_bounded(path, largest)
    try:
        value = _interpret(data)
        if not isinstance(value, dict):
            raise ValueError(f"expected a dictionary, found {type(value).__name__}")
        return {str(key): _plain(item) for key, item in value.items()}
    except InputError:
        raise
    except Exception as error:  # pickletools raises many types for damaged files
        text = "".join(c if c.isprintable() else " " for c in str(error))[:120]
        raise InputError(f"{path} must be a pickled dictionary of numbers and arrays: {text}") from error


def _interpret(data: bytes) -> Any:
    """Return the value of a pickle, with unexecuted calls."""
    stack: list[Any] = []
    memo: dict[int, Any] = {}
    argument: Any
    for count, (opcode, argument, _) in enumerate(pickletools.genops(data)):
        if count > _MOST_OPCODES:
            raise ValueError("too many entries")
        match opcode.name:
            case "PROTO" | "FRAME":
                pass
            case "STOP":
                return stack.pop()
            case "MARK":
                stack.append(_Mark)
            case "POP":
                stack.pop()
            case "POP_MARK":
                _above_mark(stack)
            case "NONE":
                stack.append(None)
            case "NEWTRUE" | "NEWFALSE":
                stack.append(opcode.name == "NEWTRUE")
            case "EMPTY_DICT":
                stack.append({})
            case "EMPTY_LIST":
                stack.append([])
            case "EMPTY_TUPLE":
                stack.append(())
            case "DICT":
                items = _above_mark(stack)
                stack.append(dict(zip(items[::2], items[1::2], strict=True)))
            case "LIST":
                stack.append(_above_mark(stack))
            case "TUPLE":
                stack.append(tuple(_above_mark(stack)))
            case "TUPLE1" | "TUPLE2" | "TUPLE3":
                size = int(opcode.name[-1])
                stack[-size:] = [tuple(stack[-size:])]
            case "APPEND":
                item = stack.pop()
                stack[-1].append(item)
            case "APPENDS":
                items = _above_mark(stack)
                stack[-1].extend(items)
            case "SETITEM":
                item, key = stack.pop(), stack.pop()
                stack[-1][key] = item
            case "SETITEMS":
                items = _above_mark(stack)
                stack[-1].update(zip(items[::2], items[1::2], strict=True))
            case "GLOBAL":
                stack.append(_Name(argument.replace(" ", ".")))
            case "STACK_GLOBAL":
                name, module = stack.pop(), stack.pop()
                stack.append(_Name(f"{module}.{name}"))
            case "REDUCE" | "NEWOBJ":
                arguments, function = stack.pop(), stack.pop()
                stack.append(_Call(function, arguments))
            case "BUILD":
                state = stack.pop()
                if isinstance(stack[-1], _Call):
                    stack[-1].state = state
            case "PUT" | "BINPUT" | "LONG_BINPUT":
                memo[argument] = stack[-1]
            case "MEMOIZE":
                memo[len(memo)] = stack[-1]
            case "GET" | "BINGET" | "LONG_BINGET":
                stack.append(memo[argument])
            case _ if opcode.arg is not None and not opcode.stack_before and len(opcode.stack_after) == 1:
                stack.append(argument)  # a number, text or bytes
            case _:
                raise ValueError(f"the opcode {opcode.name} is not supported")
    raise ValueError("it is cut off")


def _above_mark(stack: list[Any]) -> list[Any]:
    """Remove and return the items above the last mark, and remove the mark."""
    place = len(stack) - 1 - stack[::-1].index(_Mark)
    items = stack[place + 1 :]
    del stack[place:]
    return items


def _plain(value: Any) -> Any:
    """Return a number, text, array, or a list of them; None for anything else."""
    if isinstance(value, str | int | float | bytes) or value is None:
        return value
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, _Call):
        return _array(value)
    return None


def _array(call: _Call) -> Any:
    """Return the NumPy array or scalar of an unexecuted call; None if it makes anything else."""
    name = call.function.name if isinstance(call.function, _Name) else ""
    if name.endswith("multiarray.scalar"):
        kind, data = call.arguments
        scalar = _dtype(kind)
        return None if scalar is None else np.frombuffer(_bytes(data), scalar, 1)[0]
    if name.endswith("numeric._frombuffer"):  # protocol 5
        data, kind, shape, order = call.arguments
        in_columns = order == "F"
    elif name.endswith("multiarray._reconstruct") and call.state is not None:
        _, shape, kind, in_columns, data = call.state
    else:
        return None
    dtype = _dtype(kind)
    if dtype is None:
        return None
    array = np.frombuffer(_bytes(data), dtype)
    return array.reshape(shape, order="F" if in_columns else "C")


def _dtype(call: Any) -> np.dtype[Any] | None:
    """Return the type of an array; None if its items are neither numbers nor text."""
    if not (isinstance(call, _Call) and isinstance(call.function, _Name) and call.function.name == "numpy.dtype"):
        raise ValueError("an array has no type")
    dtype = np.dtype(str(call.arguments[0]))
    if dtype.kind not in _KINDS or dtype.itemsize == 0:
        return None
    big = call.state is not None and call.state[1] == ">"
    return dtype.newbyteorder(">" if big else "<")


def _bytes(data: Any) -> bytes | bytearray:
    """Return the bytes of an array.

    Python 2 wrote them as text, protocols below 3 as a call of an encoder.
    """
    if isinstance(data, _Call) and data.function == _Name("_codecs.encode"):
        data = data.arguments[0]
    return data if isinstance(data, bytes | bytearray) else str(data).encode("latin-1")
