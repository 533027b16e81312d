"""Shortcuts in numba for a process that compiles kernels into the cache, and calls none.

Most functions are parts: kernels alone call them. numba makes an entry from Python, optimal code and machine code of
each part nevertheless, and optimises it again inside each kernel.
"""

import gc
from collections.abc import Callable, Collection
from typing import Any

from llvmlite.binding import ffi, parse_bitcode
from numba.core import callwrapper, ir, lowering, types
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target

from depthtrack.ahead_analysis import shorten_analysis
from depthtrack.compilation import KernelCache

Entry = tuple[str, str, tuple[types.Type, ...]]
"""Module, name and types of the arguments of a function that Python calls."""


def take_shortcuts(entries: Collection[Entry]) -> None:
    """Change numba in this process, until its end. All other functions of the package are parts."""
    gc.disable()  # nearly all objects of the compiler live on
    ffi.lib._lock._cblist.clear()  # nobody listens to each call of LLVM
    codegen = cpu_target.target_context.codegen()
    codegen._library_class = _Library
    codegen.set_env = lambda name, environment: None  # no kernel runs
    _compile_parts(lambda module, name, arguments: (module, name, tuple(arguments)) not in entries)
    _call_without_optimising()
    shorten_analysis()
    _list_variables_quickly()


class _Library(JITCodeLibrary):  # type: ignore[misc]
    """LLVM's code of a function; that of a part is simplified alone, and kept as bitcode."""

    is_part = False

    def _optimize_functions(self, ll_module: Any) -> None:
        if not hasattr(self._codegen, "_pass_builder"):  # numba before 0.62 makes the passes once
            super()._optimize_functions(ll_module)
            return
        ll_module.data_layout = self._codegen._data_layout
        passes, builder = self._codegen._function_pass_manager(opt=1)
        for function in ll_module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def _optimize_final_module(self) -> None:
        if not self.is_part:
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        if self.is_part:
            self._finalize_dynamic_globals()
            self._finalized = True
        else:
            super()._finalize_final_module()

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0 if self.is_part else int(super().get_pointer_to_function(name))

    def serialize_using_object_code(self) -> Any:
        return self.serialize_using_bitcode() if self.is_part else super().serialize_using_object_code()

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Any:
        name, kind, data = state
        if kind != "bitcode":
            return super()._unserialize(codegen, state)
        library = codegen.create_library(name)
        library.is_part, library._final_module = True, parse_bitcode(data)
        library._finalize_final_module()
        return library


def _compile_parts(is_part: Callable[[str, str, Any], bool]) -> None:
    """Make parts without an entry, and keep them apart from functions that have one."""
    lower, make_entry = lowering.Lower.lower, lowering.Lower.create_cpython_wrapper

    def lower_part(self: Any) -> None:
        described = self.fndesc
        self.library.is_part = is_part(described.modname, described.qualname, described.argtypes)
        lower(self)

    def make_entry_if_called(self: Any, release_gil: bool = False) -> None:
        if not self.library.is_part:
            make_entry(self, release_gil)

    lowering.Lower.lower, lowering.Lower.create_cpython_wrapper = lower_part, make_entry_if_called
    kept: Any = KernelCache
    kept.is_part = staticmethod(lambda function, types: is_part(function.__module__, function.__name__, types))


def _call_without_optimising() -> None:
    """Leave the entries from Python as they are: they run once a call, and are as long as many kernels."""
    wrapper: Any = callwrapper.PyCallWrapper
    build = wrapper.build

    def build_plainly(self: Any) -> None:
        build(self)
        entry = self.module.get_global(self.fndesc.llvm_cpython_wrapper_name)
        entry.attributes.add("noinline")
        entry.attributes.add("optnone")

    wrapper.build = build_plainly


def _list_variables_quickly() -> None:
    """Replace a function that is called millions of times by a shorter one of the same result."""

    def variables(self: Any, value: Any) -> list[Any]:
        listed: list[Any] = []
        for each in value.values() if isinstance(value, dict) else value:
            if type(each) is ir.Var:
                listed.append(each)
            elif type(each) in without:
                continue
            elif isinstance(each, ir.Inst):
                listed += each.list_vars()
            elif isinstance(each, list | tuple | dict):
                listed += variables(self, each)
        return listed

    without = frozenset({ir.Loc, str, int, bool, type(None), float})
    instruction: Any = ir.Inst
    instruction._rec_list_vars = variables
