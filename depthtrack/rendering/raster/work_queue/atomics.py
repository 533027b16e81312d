"""Steps that no other thread can see half done, for numba kernels that share work; arrays are int64."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


def _place(context: Any, builder: ir.IRBuilder, array: Any, value: ir.Value, index: ir.Value) -> ir.Value:
    return builder.gep(context.make_array(array)(context, builder, value).data, [index], inbounds=True)


@intrinsic
def fetch_add(typing_context: Any, array: types.Type, index: types.Type, amount: types.Type) -> Any:
    """Add to an element and return what it held."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        step = context.cast(builder, arguments[2], amount, types.int64)
        return builder.atomic_rmw("add", _place(context, builder, array, *arguments[:2]), step, "acq_rel")

    return types.int64(array, index, amount), generate


@intrinsic
def peek(typing_context: Any, array: types.Type, index: types.Type) -> Any:
    """An element as it is now; what was written before it was published is seen as well."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        return builder.load_atomic(_place(context, builder, array, *arguments), "acquire", 8)

    return types.int64(array, index), generate


@intrinsic
def publish(typing_context: Any, array: types.Type, index: types.Type, value: types.Type) -> Any:
    """Set an element after everything that was written before."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        number = context.cast(builder, arguments[2], value, types.int64)
        builder.store_atomic(number, _place(context, builder, array, *arguments[:2]), "release", 8)
        return context.get_dummy_value()

    return types.void(array, index, value), generate


@intrinsic
def relax(typing_context: Any) -> Any:
    """Let the processor breathe in a loop that waits."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        if context.codegen().magic_tuple()[0].startswith("x86_64"):
            pause = ir.FunctionType(ir.VoidType(), [])
            builder.call(cgutils.get_or_insert_function(builder.module, pause, "llvm.x86.sse2.pause"), [])
        return context.get_dummy_value()

    return types.void(), generate
