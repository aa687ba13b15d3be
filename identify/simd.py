"""Eight or four numbers abreast: a vector type for compiled code, whose speed then hangs on no compiler's guess.

A ``lanes`` value is eight doubles in one register (or in two or four, where the machine's are narrower). It exists
inside compiled functions only; arrays are loaded and stored by flat index.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.extending import intrinsic, overload, register_model

#: Numbers abreast.
WIDTH = 8

#: How the code on the hot path is compiled: no reference counts, so it may neither make nor cut arrays; a product and
#: a sum may become one operation, and zeros have no sign.
COMPILED = {
    "cache": True,
    "nogil": True,
    "_nrt": False,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz"},
}
#: The same for what only compiled code calls, written out where it is called: a call would hand over every array of
#: its tuples, word by word.
INLINED = COMPILED | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "forceinline": True}

_INDEX = ir.IntType(32)
_FLAGS = ("contract", "nsz")


def _vector(width: int) -> Any:
    return ir.VectorType(ir.DoubleType(), width)


class Lanes(types.Type):
    """The type of so many doubles abreast."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Lanes{width}")


LANES, HALF = Lanes(WIDTH), Lanes(WIDTH // 2)


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _vector(kind.width))


def _address(context: Any, builder: Any, array: Any, value: Any, index: Any, width: int) -> Any:
    data = context.make_array(array)(context, builder, value).data
    place = builder.gep(builder.bitcast(data, ir.DoubleType().as_pointer()), [index])
    return builder.bitcast(place, _vector(width).as_pointer())


@intrinsic  # type: ignore[untyped-decorator]
def load(_: Any, array: Any, index: Any) -> Any:
    """Eight numbers of a contiguous array from flat ``index`` on."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        value = builder.load(_address(context, builder, signature.args[0], args[0], args[1], WIDTH))
        value.align = 8
        return value

    return LANES(array, types.intp), code


@intrinsic  # type: ignore[untyped-decorator]
def load_like(_: Any, other: Any, array: Any, index: Any) -> Any:
    """As many numbers as ``other`` has."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = _address(context, builder, signature.args[1], args[1], args[2], other.width)
        value = builder.load(place)
        value.align = 8
        return value

    return other(other, array, types.intp), code


@intrinsic  # type: ignore[untyped-decorator]
def store(_: Any, array: Any, index: Any, value: Any) -> Any:
    """Put what lies abreast into a contiguous array from flat ``index`` on."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        address = _address(context, builder, signature.args[0], args[0], args[1], value.width)
        builder.store(args[2], address, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, value), code


def _place(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    array = context.make_array(signature.args[0])(context, builder, args[0])
    return builder.gep(array.data, [args[1]])


@intrinsic  # type: ignore[untyped-decorator]
def take(_: Any, array: Any, index: Any) -> Any:
    """One element of a contiguous array by flat ``index``, which is not counted from the end where it is negative."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load(_place(context, builder, signature, args))

    return array.dtype(array, types.intp), code


@intrinsic  # type: ignore[untyped-decorator]
def put(_: Any, array: Any, index: Any, value: Any) -> Any:
    """Put one number into a contiguous array at flat ``index``, likewise."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.store(args[2], _place(context, builder, signature, args))
        return context.get_dummy_value()

    return types.void(array, types.intp, types.float64), code


def _spread(builder: Any, value: Any, width: int) -> Any:
    """The code of one number, so many times."""
    undefined = ir.Constant(_vector(width), ir.Undefined)
    one = builder.insert_element(undefined, value, ir.Constant(_INDEX, 0))
    return builder.shuffle_vector(one, undefined, ir.Constant(ir.VectorType(_INDEX, width), [0] * width))


@intrinsic  # type: ignore[untyped-decorator]
def splat(_: Any, value: Any) -> Any:
    """One number, eight times."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _spread(builder, args[0], WIDTH)

    return LANES(types.float64), code


@intrinsic  # type: ignore[untyped-decorator]
def splat_half(_: Any, value: Any) -> Any:
    """One number, four times."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _spread(builder, args[0], HALF.width)

    return HALF(types.float64), code


@intrinsic  # type: ignore[untyped-decorator]
def widened(_: Any, half: Any) -> Any:
    """Four numbers, and four zeros after them."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        zeros = ir.Constant(_vector(HALF.width), [0.0] * HALF.width)
        mask = ir.Constant(ir.VectorType(_INDEX, WIDTH), list(range(WIDTH)))
        return builder.shuffle_vector(args[0], zeros, mask)

    return LANES(HALF), code


@intrinsic  # type: ignore[untyped-decorator]
def lane(_: Any, vector: Any, index: Any) -> Any:
    """One of the eight numbers."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.extract_element(args[0], builder.trunc(args[1], _INDEX))

    return types.float64(vector, types.intp), code


def _calling(name: str) -> Any:
    """An operation on every lane by the LLVM function of this name."""

    @intrinsic  # type: ignore[untyped-decorator]
    def operation(_: Any, vector: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            kind = ir.FunctionType(_vector(WIDTH), [_vector(WIDTH)])
            function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")
            return builder.call(function, args)

        return LANES(LANES), code

    return operation


absolute = _calling("fabs")
root = _calling("sqrt")
nearest = _calling("rint")


def _choosing(sign: str) -> Any:
    """The one of two for which the comparison holds, lane by lane; the second where one is no number."""

    @intrinsic  # type: ignore[untyped-decorator]
    def operation(_: Any, one: Any, other: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.select(builder.fcmp_ordered(sign, args[0], args[1]), args[0], args[1])

        return LANES(LANES, LANES), code

    return operation


larger = _choosing(">")
smaller = _choosing("<")


def _arithmetic(function: Callable[..., Any], name: str) -> None:
    @intrinsic  # type: ignore[untyped-decorator]
    def operation(_: Any, one: Any, other: Any) -> Any:
        kind = one if isinstance(one, Lanes) else other

        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            both = [
                a if isinstance(t, Lanes) else _spread(builder, a, kind.width)
                for a, t in zip(args, signature.args, strict=True)
            ]
            return getattr(builder, name)(*both, flags=_FLAGS)

        return kind(one, other), code

    @overload(function)
    def compiled(a, b):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - numba compares the signatures
        kinds = {t for t in (a, b) if isinstance(t, Lanes)}
        if len(kinds) == 1 and all(isinstance(t, Lanes | types.Float) for t in (a, b)):
            return lambda a, b: operation(a, b)
        return None


for _function, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _arithmetic(_function, _name)
