"""Functions of SIMD vectors: exact and estimated roots, reciprocals, reductions."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from depthtrack.simd.vectors import F32X16, Emit, Vector, element_of, operands, widen_all


def _call(builder: ir.IRBuilder, name: str, result: ir.Type, *arguments: ir.Value) -> ir.Value:
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(result, [argument.type for argument in arguments]), name
    )
    return builder.call(function, arguments)


def _unary(name: str) -> Any:
    @intrinsic
    def function(typing_context: Any, a: types.Type) -> Any:
        def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
            suffix = f"v{a.lanes}f{a.element.bitwidth}"
            return _call(builder, f"llvm.{name}.{suffix}", a.llvm(), arguments[0])

        return (a(a), generate) if isinstance(a, Vector) else None

    return function


vsqrt = _unary("sqrt")
vabs = _unary("fabs")
vfloor = _unary("floor")


def _features(context: Any) -> list[str]:
    """What the processor that is compiled for can do, as LLVM names it."""
    return str(context.codegen().magic_tuple()[2]).split(",")


def _lanes(builder: ir.IRBuilder, a: ir.Value, b: ir.Value, which: list[int]) -> ir.Value:
    """Lanes of two vectors, counted through, in any order."""
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), len(which)), which))


def _estimate(name: str, exactly: Callable[[ir.IRBuilder, ir.Value], ir.Value]) -> Any:
    """A function of float32 lanes that processors estimate far faster than they compute it.

    At least 11 bits are right, so that one Newton step makes 22; exact on a processor that has no estimate.
    """

    @intrinsic
    def function(typing_context: Any, a: types.Type) -> Any:
        def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
            (x,), features = arguments, _features(context)
            if "+avx512f" in features:
                return _call(
                    builder, f"llvm.x86.avx512.{name}14.ps.512", x.type, x, x, ir.Constant(ir.IntType(16), 0xFFFF)
                )
            if "+avx" in features:
                halves = [_lanes(builder, x, x, list(range(n, n + 8))) for n in (0, 8)]
                low, high = (_call(builder, f"llvm.x86.avx.{name}.ps.256", half.type, half) for half in halves)
                return _lanes(builder, low, high, list(range(16)))
            return exactly(builder, x)

        return (a(a), generate) if a == F32X16 else None

    return function


def _one_over(builder: ir.IRBuilder, x: ir.Value) -> ir.Value:
    return builder.fdiv(ir.Constant(x.type, [1.0] * x.type.count), x)


estimated_reciprocal = _estimate("rcp", _one_over)
estimated_reciprocal_sqrt = _estimate(
    "rsqrt", lambda builder, x: _one_over(builder, _call(builder, "llvm.sqrt.v16f32", x.type, x))
)


@intrinsic
def max_or(typing_context: Any, a: types.Type, b: types.Type) -> Any:
    """The larger of each two lanes, and b's where either is NaN."""
    vector = operands(a, b)
    if vector is None:
        return None

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        x, y = widen_all(context, builder, signature.args, arguments, vector)
        if vector == F32X16 and "+avx512f" in _features(context):
            # Of the plain form LLVM makes a masked store, from which later loads cannot be forwarded.
            return _call(builder, "llvm.x86.avx512.max.ps.512", x.type, x, y, ir.Constant(ir.IntType(32), 4))
        return builder.select(builder.fcmp_ordered(">", x, y), x, y)

    return vector(a, b), generate


@intrinsic
def first(typing_context: Any, a: types.Type) -> Any:
    """The first lane, a scalar."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        return builder.extract_element(arguments[0], ir.Constant(ir.IntType(32), 0))

    return (a.element(a), generate) if isinstance(a, Vector) else None


@intrinsic
def bits_of(typing_context: Any, mask: types.Type) -> Any:
    """A mask as the bits of an integer, the first lane the lowest."""
    if element_of(mask) != types.boolean:
        return None

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        bits = builder.bitcast(arguments[0], ir.IntType(mask.lanes))
        return builder.zext(bits, ir.IntType(64))

    return types.int64(mask), generate


@intrinsic
def count_bits(typing_context: Any, bits: types.Type) -> Any:
    """The number of set bits of an int64."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        return builder.ctpop(arguments[0])

    return (types.int64(bits), generate) if bits == types.int64 else None


@intrinsic
def eight(typing_context: Any, a: types.Type, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    """A vector of eight float64 scalars."""
    vector = Vector(types.float64, 8)

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        value = ir.Constant(vector.llvm(), ir.Undefined)
        for lane, scalar in enumerate(arguments):
            value = builder.insert_element(value, scalar, ir.Constant(ir.IntType(32), lane))
        return value

    return (vector(*(8 * [a])), generate) if {a, b, c, d, e, f, g, h} == {types.float64} else None


@intrinsic
def narrow(typing_context: Any, a: types.Type) -> Any:
    """The same lanes in float32."""
    if element_of(a) != types.float64:
        return None
    single = Vector(types.float32, a.lanes)

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        return builder.fptrunc(arguments[0], single.llvm())

    return single(a), generate


@intrinsic
def vsum(typing_context: Any, a: types.Type) -> Any:
    """Sum of the lanes, halves upon halves: the order is fixed, so the bits are."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        value = arguments[0]
        while (half := value.type.count // 2) > 0:
            low = _lanes(builder, value, value, list(range(half)))
            value = builder.fadd(low, _lanes(builder, value, value, list(range(half, 2 * half))))
        return builder.extract_element(value, ir.Constant(ir.IntType(32), 0))

    return (a.element(a), generate) if isinstance(a, Vector) else None


def _of_halves(combine: Emit) -> Any:
    @intrinsic
    def function(typing_context: Any, a: types.Type) -> Any:
        def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
            value, distance = arguments[0], a.lanes // 4
            while distance:
                # Every lane meets the one `distance` away, within its half of the vector.
                other = _lanes(builder, value, value, [n ^ distance for n in range(a.lanes)])
                value, distance = combine(builder, value, other), distance // 2
            at = [ir.Constant(ir.IntType(32), n) for n in (0, a.lanes // 2)]
            return context.make_tuple(builder, signature.return_type, [builder.extract_element(value, n) for n in at])

        return (types.UniTuple(a.element, 2)(a), generate) if isinstance(a, Vector) else None

    return function


lowest_of_halves = _of_halves(lambda builder, a, b: builder.select(builder.fcmp_ordered("<", a, b), a, b))
highest_of_halves = _of_halves(lambda builder, a, b: builder.select(builder.fcmp_ordered(">", a, b), a, b))


@intrinsic
def fused(typing_context: Any, a: types.Type, b: types.Type, c: types.Type) -> Any:
    """Return a * b + c of float64 numbers, rounded once."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> ir.Value:
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate
