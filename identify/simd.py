"""Eight numbers abreast: a vector type for compiled code, so that its speed does not hang on what a compiler guesses.

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
#: The same for what only compiled code calls, and for what is best written out where it is called.
HELPER = COMPILED | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
INLINED = HELPER | {"forceinline": True}

_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_INDEX = ir.IntType(32)
_FLAGS = ("contract", "nsz")


class Lanes(types.Type):
    """The type of eight doubles abreast."""

    def __init__(self) -> None:
        super().__init__(name="Lanes8")


LANES = Lanes()


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _address(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    array = context.make_array(signature.args[0])(context, builder, args[0])
    place = builder.bitcast(array.data, ir.DoubleType().as_pointer())
    return builder.bitcast(builder.gep(place, [args[1]]), _VECTOR.as_pointer())


@intrinsic  # type: ignore[untyped-decorator]
def load(_: Any, array: Any, index: Any) -> Any:
    """Eight numbers of a contiguous array from flat ``index`` on."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        value = builder.load(_address(context, builder, signature, args))
        value.align = 8
        return value

    return LANES(array, types.intp), code


@intrinsic  # type: ignore[untyped-decorator]
def store(_: Any, array: Any, index: Any, value: Any) -> Any:
    """Put eight numbers into a contiguous array from flat ``index`` on."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.store(args[2], _address(context, builder, signature, args), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, LANES), code


@intrinsic  # type: ignore[untyped-decorator]
def splat(_: Any, value: Any) -> Any:
    """One number, eight times."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), args[0], ir.Constant(_INDEX, 0))
        mask = ir.Constant(ir.VectorType(_INDEX, WIDTH), [0] * WIDTH)
        return builder.shuffle_vector(one, ir.Constant(_VECTOR, ir.Undefined), mask)

    return LANES(types.float64), code


@intrinsic  # type: ignore[untyped-decorator]
def lane(_: Any, vector: Any, index: Any) -> Any:
    """One of the eight numbers."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.extract_element(args[0], builder.trunc(args[1], _INDEX))

    return types.float64(LANES, types.intp), code


def _calling(name: str) -> Any:
    """An operation on every lane by the LLVM function of this name."""

    @intrinsic  # type: ignore[untyped-decorator]
    def operation(_: Any, vector: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            kind = ir.FunctionType(_VECTOR, [_VECTOR])
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
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return getattr(builder, name)(args[0], args[1], flags=_FLAGS)

        return LANES(LANES, LANES), code

    @overload(function)
    def compiled(a, b):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - numba compares the signatures
        if a is LANES and b is LANES:
            return lambda a, b: operation(a, b)
        if a is LANES and isinstance(b, types.Float):
            return lambda a, b: operation(a, splat(b))
        if isinstance(a, types.Float) and b is LANES:
            return lambda a, b: operation(splat(a), b)
        return None


for _function, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _arithmetic(_function, _name)
