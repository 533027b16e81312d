"""Explicit SIMD for numba kernels: short vectors that behave like numbers.

LLVM's auto-vectoriser gives up on the rasteriser's loops, so their inner lines are written on vectors: a value of
type `Vector(float32, 16)` is one AVX-512 register (two on AVX2, four on SSE), with the usual operators. All functions
here exist only inside numba-compiled code; those that read a vector are in `simd_functions`.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel import models
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import intrinsic, lower_builtin, register_model

from depthtrack.compilation import compiled


class Vector(types.Type):
    """`lanes` elements of a numba scalar type; `boolean` elements make a mask."""

    def __init__(self, element: types.Type, lanes: int) -> None:
        self.element, self.lanes = element, lanes
        super().__init__(name=f"Vector({element} x {lanes})")

    @property
    def mask(self) -> "Vector":
        return Vector(types.boolean, self.lanes)

    def llvm(self) -> ir.Type:
        return ir.VectorType(_LLVM_ELEMENTS[self.element], self.lanes)


_LLVM_ELEMENTS: dict[types.Type, ir.Type] = {
    types.float32: ir.FloatType(),
    types.float64: ir.DoubleType(),
    types.boolean: ir.IntType(1),
}
F32X16 = Vector(types.float32, 16)
F64X8 = Vector(types.float64, 8)
# Multiply-adds may be fused: the same machine gives the same bits, whatever the number of threads.
_FLAGS = ("contract", "nsz")


def kernel_part(function: Callable[..., Any]) -> Any:
    """Compile a function that only kernels call; arrays are lent to it.

    Counting references to them would take locked instructions at every call, longer than much of the work itself.
    """
    return compiled(_nrt=False)(function)


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, vector: Vector) -> None:
        super().__init__(manager, vector, vector.llvm())


def element_of(value: types.Type) -> types.Type | None:
    return value.element if isinstance(value, Vector) else None


def operands(a: types.Type, b: types.Type) -> Vector | None:
    """Return the common vector type of two operands, None if neither is a vector of floats."""
    vector = a if isinstance(a, Vector) else b
    other = b if vector is a else a
    if not isinstance(vector, Vector) or vector.element == types.boolean:
        return None
    return vector if other == vector or isinstance(other, types.Float | types.Integer) else None


def _widen(context: Any, builder: ir.IRBuilder, value: ir.Value, found: types.Type, wanted: Vector) -> ir.Value:
    if isinstance(found, Vector):
        return value
    scalar = context.cast(builder, value, found, wanted.element)
    single = builder.insert_element(ir.Constant(wanted.llvm(), ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0))
    lanes = ir.Constant(ir.VectorType(ir.IntType(32), wanted.lanes), [0] * wanted.lanes)
    return builder.shuffle_vector(single, ir.Constant(wanted.llvm(), ir.Undefined), lanes)


Emit = Callable[[ir.IRBuilder, ir.Value, ir.Value], ir.Value]


def widen_all(context: Any, builder: ir.IRBuilder, found: Any, values: Any, wanted: Vector) -> list[ir.Value]:
    """Operands of the types `found` as vectors of one type."""
    return [_widen(context, builder, value, t, wanted) for value, t in zip(values, found, strict=True)]


def _binary(emit: Emit) -> Any:
    @intrinsic
    def function(typing_context: Any, a: types.Type, b: types.Type) -> Any:
        vector = operands(a, b)

        def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
            assert vector is not None
            return emit(builder, *widen_all(context, builder, signature.args, arguments, vector))

        return vector and (vector(a, b), generate)

    return function


def _operator(symbol: Any, emit: Emit, compares: bool = False) -> None:
    """Register an operator on vectors with numba.

    An `@overload` would be compiled again for every use.
    """

    class Typing(AbstractTemplate):
        def generic(self, arguments: Any, _: Any) -> Any:
            vector = operands(*arguments) if len(arguments) == 2 else None
            return vector and (vector.mask if compares else vector)(*arguments)

    infer_global(symbol)(Typing)

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        vector = operands(*signature.args)
        assert vector is not None
        return emit(builder, *widen_all(context, builder, signature.args, arguments, vector))

    for a, b in ((Vector, Vector), (Vector, types.Number), (types.Number, Vector)):
        lower_builtin(symbol, a, b)(generate)


_operator(operator.add, lambda builder, a, b: builder.fadd(a, b, flags=_FLAGS))
_operator(operator.sub, lambda builder, a, b: builder.fsub(a, b, flags=_FLAGS))
_operator(operator.mul, lambda builder, a, b: builder.fmul(a, b, flags=_FLAGS))
_operator(operator.truediv, lambda builder, a, b: builder.fdiv(a, b, flags=_FLAGS))
_operator(operator.gt, lambda builder, a, b: builder.fcmp_ordered(">", a, b), compares=True)
_operator(operator.lt, lambda builder, a, b: builder.fcmp_ordered("<", a, b), compares=True)
_operator(operator.ge, lambda builder, a, b: builder.fcmp_ordered(">=", a, b), compares=True)

vmax = _binary(lambda builder, a, b: builder.select(builder.fcmp_ordered(">", a, b), a, b))
vmin = _binary(lambda builder, a, b: builder.select(builder.fcmp_ordered("<", a, b), a, b))


@intrinsic
def both(typing_context: Any, a: types.Type, b: types.Type) -> Any:
    """Lanes set in both masks."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        return builder.and_(*arguments)

    return (a(a, b), generate) if element_of(a) == types.boolean and a == b else None


@intrinsic
def either(typing_context: Any, a: types.Type, b: types.Type) -> Any:
    """Lanes set in one mask or the other."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        return builder.or_(*arguments)

    return (a(a, b), generate) if element_of(a) == types.boolean and a == b else None


@intrinsic
def select(typing_context: Any, mask: types.Type, a: types.Type, b: types.Type) -> Any:
    """Lanes of `a` where the mask is set, of `b` elsewhere; either may be a scalar, not both."""
    vector = operands(a, b)
    if vector is None or element_of(mask) != types.boolean:
        return None

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        return builder.select(arguments[0], *widen_all(context, builder, signature.args[1:], arguments[1:], vector))

    return vector(mask, a, b), generate


def _address(
    context: Any, builder: ir.IRBuilder, array: Any, value: ir.Value, index: ir.Value, to: ir.Type
) -> ir.Value:
    data = context.make_array(array)(context, builder, value).data
    return builder.bitcast(builder.gep(data, [index], inbounds=True), to.as_pointer())


def loader(vector: Vector) -> Any:
    """Return `load(array, index)`, which reads a vector of a contiguous 1-d array, unchecked."""

    @intrinsic
    def load(typing_context: Any, array: types.Type, index: types.Type) -> Any:
        def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
            data, at = arguments
            pointer = _address(context, builder, array, data, at, vector.llvm())
            return builder.load(pointer, align=vector.element.bitwidth // 8)

        return vector(array, index), generate

    return load


@intrinsic
def store(typing_context: Any, array: types.Type, index: types.Type, vector: types.Type) -> Any:
    """Write all lanes into a contiguous 1-d array from any index on, unchecked."""
    if not isinstance(vector, Vector):
        return None

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        data, at, value = arguments
        pointer = _address(context, builder, array, data, at, vector.llvm())
        builder.store(value, pointer, align=vector.element.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, index, vector), generate


def filler(vector: Vector) -> Any:
    """A function `fill(scalar)`: the scalar in every lane."""

    @intrinsic
    def fill(typing_context: Any, scalar: types.Type) -> Any:
        def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
            return _widen(context, builder, arguments[0], scalar, vector)

        return vector(scalar), generate

    return fill
