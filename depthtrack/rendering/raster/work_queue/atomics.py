"""Atomic operations on int64 arrays, for numba kernels of several threads."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


def _element(context: Any, builder: ir.IRBuilder, array: Any, value: ir.Value, index: ir.Value) -> ir.Value:
    """Return the address of an element."""
    return builder.gep(context.make_array(array)(context, builder, value).data, [index], inbounds=True)


@intrinsic
def fetch_add(typing_context: Any, array: types.Type, index: types.Type, amount: types.Type) -> Any:
    """Add to an element and return its value from before."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        step = context.cast(builder, arguments[2], amount, types.int64)
        return builder.atomic_rmw("add", _element(context, builder, array, *arguments[:2]), step, "acq_rel")

    return types.int64(array, index, amount), generate


@intrinsic
def load_acquire(typing_context: Any, array: types.Type, index: types.Type) -> Any:
    """Return an element; reads after it see all writes from before the matching `store_release`."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        return builder.load_atomic(_element(context, builder, array, *arguments), "acquire", 8)

    return types.int64(array, index), generate


@intrinsic
def store_release(typing_context: Any, array: types.Type, index: types.Type, value: types.Type) -> Any:
    """Set an element after all writes from before."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        number = context.cast(builder, arguments[2], value, types.int64)
        builder.store_atomic(number, _element(context, builder, array, *arguments[:2]), "release", 8)
        return context.get_dummy_value()

    return types.void(array, index, value), generate


@intrinsic
def spin_pause(typing_context: Any) -> Any:
    """Run the processor's pause instruction, if it has one, for loops that poll."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        if context.codegen().magic_tuple()[0].startswith("x86_64"):
            pause = ir.FunctionType(ir.VoidType(), [])
            builder.call(cgutils.get_or_insert_function(builder.module, pause, "llvm.x86.sse2.pause"), [])
        return context.get_dummy_value()

    return types.void(), generate
