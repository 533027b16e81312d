"""Shortcuts in numba's analysis and lowering for a process that compiles kernels into the cache, and calls none.

They leave the code as it is. numba analyses a function after each pass, describes each pass for listeners, looks up
each size of a type in a module of LLVM, and takes all members of a tuple apart to find arrays that it counts.
"""

from functools import cache
from typing import Any

from llvmlite import ir as llvm
from numba.core import codegen, compiler_machinery, cpu, postproc, targetconfig, transforms, typed_passes, types, typing
from numba.core.runtime.context import NRTContext
from numba.core.ssa import _logger as ssa_logger


def shorten_analysis() -> None:
    """Change numba in this process, until its end."""
    _look_up_types_once()
    _look_up_sizes_once()
    _import_implementations_once()
    _analyse_last_alone()
    _run_passes_without_listeners()
    _take_counted_members()
    codegen.CPUCodegen._check_llvm_bugs = lambda self: None
    ssa_logger.debug = lambda *arguments: None


def _look_up_types_once() -> None:
    """Keep the types that calls of numba's own functions have."""
    options: Any = targetconfig.TargetConfig
    function: Any = types.Function
    compare, find, known = options.__eq__, function.get_call_type, dict[Any, list[tuple[Any, Any, Any]]]()

    def is_equal(self: Any, other: Any) -> Any:
        return (type(self) is type(other) and self._values == other._values) or compare(self, other)

    def call_type(self: Any, context: Any, arguments: Any, keywords: Any) -> Any:
        top = targetconfig.ConfigStack.top_or_none()
        values = None if top is None else top._values
        found = known.setdefault((id(self), context, tuple(arguments), tuple(keywords.items())), [])
        for of, kind, _ in found:
            if of == values:
                return kind
        kind = find(self, context, arguments, keywords)
        found.append((values and dict(values), kind, self))  # the function lives, so that its id stays its own
        return kind

    options.__eq__ = is_equal
    options.__hash__ = lambda self: hash(type(self))  # numba hashes the names of the options
    function.get_call_type = call_type


def _look_up_sizes_once() -> None:
    """Keep the size of each type; LLVM's tables of this machine are always the same."""
    kind: Any = llvm.types.Type
    size = kind.get_abi_size
    kind.get_abi_size = cache(lambda self, data, context=None: size(self, data, context))


def _import_implementations_once() -> None:
    """Install what is new of registries, without the imports that made them."""

    def shorten(contexts: Any) -> None:
        load, done = contexts.load_additional_registries, set[int]()

        def install(self: Any) -> None:
            if id(self) in done:
                for registry in tuple(self._registries):
                    self.install_registry(registry)
            else:
                load(self)
                done.add(id(self))

        contexts.load_additional_registries = install

    shorten(cpu.CPUContext)
    shorten(typing.Context)


def _analyse_last_alone() -> None:
    """Leave out live variables, which generators alone need, and annotations of the source."""
    processor: Any = postproc.PostProcessor
    run = processor.run

    def run_shortly(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
        function = self.func_ir
        if function.is_generator:
            run(self, emit_dels, extend_lifetimes)
            return
        function.blocks = transforms.canonicalize_cfg(function.blocks)
        function.variable_lifetime = postproc.VariableLifetime(function.blocks)
        function.generator_info = None
        if emit_dels:
            self._insert_var_dels(extend_lifetimes=extend_lifetimes)

    def annotate(self: Any, state: Any) -> bool:
        state.type_annotation = ""
        return False

    processor.run = run_shortly
    typed_passes.AnnotateTypes.run_pass = annotate


def _run_passes_without_listeners() -> None:
    """Run each pass without times, checks and a description of the function."""
    manager: Any = compiler_machinery.PassManager
    registry: Any = compiler_machinery._pass_registry

    def run(self: Any, index: int, each: Any, state: Any) -> None:
        each.analysis = self._analysis
        is_changed = False
        for step in (each.run_initialization, each.run_pass, each.run_finalizer):
            is_changed |= step(state)
        if registry.get(type(each)).mutates_CFG:
            if is_changed:
                postproc.PostProcessor(state.func_ir).run()
            else:
                state.func_ir.blocks = transforms.canonicalize_cfg(state.func_ir.blocks)

    manager._runPass = run


def _take_counted_members() -> None:
    """Take apart tuples for the arrays in them alone."""

    @cache
    def is_counted(model: Any) -> bool:
        return bool(model.contains_nrt_meminfo())

    def counted(self: Any, builder: Any, kind: Any, value: Any) -> list[Any]:
        models = self._context.data_model_manager
        model = models[kind]
        found = [(kind, model.get_nrt_meminfo(builder, value))] if model.has_nrt_meminfo() else []
        for member, take in model.traverse(builder):
            if is_counted(models[member]):
                found += counted(self, builder, member, take(value))
        return found

    NRTContext.get_meminfos = counted
