"""Sixteen float32 numbers that are added and multiplied at once, as processors do: the lanes of a vector.

Kernels write formulas with lanes as with numbers: `load` takes them from an array, `store` puts them back, and a number
in a formula stands for sixteen copies of it. LLVM turns them into the processor's vectors: one of AVX-512, two of AVX2,
four of NEON or SSE; a product and a sum become one instruction. Lanes are summed in the same order everywhere.

First come the functions as they run without compilation (NUMBA_DISABLE_JIT), with NumPy arrays as lanes; then what they
are compiled to.
"""

from __future__ import annotations

import itertools
import operator
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import models, register_model
from numpy.typing import NDArray

from swarm_pz.kernels.arrays import Float32s

WIDTH = 16
Lanes: TypeAlias = Any
"""Sixteen float32 numbers."""


def load(array: Float32s, *place: int) -> Lanes:
    """Return sixteen consecutive numbers of an array (..., n), from a place on."""
    return array[place[:-1]][place[-1] : place[-1] + WIDTH].copy()


def store(lanes: Lanes, array: Float32s, *place: int) -> None:
    """Write lanes into an array (..., n), from a place on."""
    array[place[:-1]][place[-1] : place[-1] + WIDTH] = lanes


def spread(number: np.float32) -> Lanes:
    """Return sixteen of the same number."""
    return np.full(WIDTH, number, np.float32)


def floor(lanes: Lanes) -> Lanes:
    """Round each lane down to a whole number."""
    return np.floor(lanes)


def larger(one: Lanes, other: Lanes) -> Lanes:
    """Return the larger number in each lane of two."""
    return np.where(one > other, one, other)


def sum_rows(array: Float32s, *place: int) -> Lanes:
    """Return the sums of sixteen consecutive rows of sixteen numbers in an array (..., n), from a place on."""
    start = place[-1]
    rows: NDArray[np.float32] = array[place[:-1]][start : start + WIDTH * WIDTH].reshape(WIDTH, 2, -1)
    while rows.shape[2] > 1:  # halves are added, as in vectors
        rows = (rows[:, 0] + rows[:, 1]).reshape(WIDTH, 2, -1)
    return rows[:, 0, 0] + rows[:, 1, 0]


_ARITHMETIC = (operator.add, operator.sub, operator.mul, operator.iadd, operator.isub, operator.imul)


class _Type(types.Type):
    """numba's type of lanes."""


_LANES = _Type("lanes")
_VECTOR = ir.VectorType(ir.FloatType(), WIDTH)


@register_model(_Type)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _shuffle(builder: Any, one: Any, other: Any, places: list[int]) -> Any:
    return builder.shuffle_vector(one, other, ir.Constant(ir.VectorType(ir.IntType(32), len(places)), places))


def _repeat(builder: Any, value: Any) -> Any:
    """Return a vector of sixteen times the same value."""
    number = ir.Constant(ir.IntType(32), 0)
    single = builder.insert_element(ir.Constant(ir.VectorType(value.type, WIDTH), ir.Undefined), value, number)
    return _shuffle(builder, single, single, [0] * WIDTH)


def _call(builder: Any, name: str, result: Any, *arguments: Any) -> Any:
    kinds = [argument.type for argument in arguments]
    return builder.call(cgutils.get_or_insert_function(builder.module, ir.FunctionType(result, kinds), name), arguments)


def _pointer(context: Any, builder: Any, kinds: Any, array: Any, *place: Any) -> Any:
    kind, *of_place = kinds
    own = context.make_array(kind)(context, builder, array)
    indices = [context.cast(builder, *one, types.intp) for one in zip(place, of_place, strict=True)]
    item = cgutils.get_item_pointer(context, builder, kind, own, indices, wraparound=False)
    return builder.bitcast(item, _VECTOR.as_pointer())


def _define(function: Callable[..., Any], result: Any, *kinds: Any) -> Callable[[Callable[..., Any]], None]:
    """Let kernels call a function with arguments of these kinds; return a decorator for the code that compiles it.

    After an array come the indices of a place in it.
    """
    is_ours = function not in _ARITHMETIC

    def fits(argument: Any, kind: Any) -> bool:
        if kind is types.Array:
            return isinstance(argument, kind) and argument.dtype == types.float32 and argument.layout == "C"
        return argument in (_LANES, types.float32) if kind is _Type else isinstance(argument, kind)

    class Template(AbstractTemplate):
        def generic(self, arguments: Any, _: Any) -> Any:
            own = arguments[: len(kinds)]
            if len(own) < len(kinds) or not all(map(fits, own, kinds)) or not (_LANES in own or is_ours):
                return None
            place = own[-1].ndim if kinds[-1] is types.Array else 0
            return signature(result, *arguments) if len(arguments) == len(kinds) + place else None

    infer_global(function)(Template)

    def register(instructions: Callable[..., Any]) -> None:
        def lower(context: Any, builder: Any, call: Any, arguments: Any) -> Any:
            values = [
                _repeat(builder, value) if kind is _Type and own != _LANES else value
                for own, value, kind in itertools.zip_longest(call.args, arguments, kinds)
            ]
            made = instructions(context, builder, call.args, *values)
            return context.get_dummy_value() if result is types.none else made

        options = [(_Type, types.Float) if kind is _Type else (kind,) for kind in kinds]
        rest = (types.VarArg(types.Any),) if kinds[-1] is types.Array else ()
        for chosen in itertools.product(*options):
            lower_builtin(function, *chosen, *rest)(lower)

    return register


@_define(load, _LANES, types.Array)
def _load(context: Any, builder: Any, kinds: Any, *place: Any) -> Any:
    return builder.load(_pointer(context, builder, kinds, *place), align=4)


@_define(store, types.none, _Type, types.Array)
def _store(context: Any, builder: Any, kinds: Any, lanes: Any, *place: Any) -> Any:
    builder.store(lanes, _pointer(context, builder, kinds[1:], *place), align=4)


_define(spread, _LANES, types.Float)(lambda _, builder, __, number: _repeat(builder, number))


@_define(floor, _LANES, _Type)
def _floor(_: Any, builder: Any, __: Any, lanes: Any) -> Any:
    return _call(builder, "llvm.floor.v16f32", _VECTOR, lanes)


@_define(larger, _LANES, _Type, _Type)
def _larger(_: Any, builder: Any, __: Any, one: Any, other: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", one, other), one, other)


@_define(sum_rows, _LANES, types.Array)
def _sum_rows(context: Any, builder: Any, kinds: Any, *place: Any) -> Any:
    """Add the two halves of every row, again and again; each time two vectors of rows become one.

    The order of the rows lets the last steps mix lanes only within groups of four, which is quicker.
    """
    first, half = _pointer(context, builder, kinds, *place), WIDTH // 2
    order = [row for start in range(4) for row in range(start, WIDTH, 4)]
    rows = [builder.load(builder.gep(first, [ir.Constant(ir.IntType(64), row)]), align=4) for row in order]
    while half:
        span = WIDTH if half >= 4 else 4
        starts = [start + vector for start in range(0, WIDTH, span) for vector in (0, WIDTH)]
        lower = [start + number for start in starts for number in range(span) if number // half % 2 == 0]
        upper = [number + half for number in lower]
        pairs = zip(rows[::2], rows[1::2], strict=True)
        rows = [builder.fadd(_shuffle(builder, *pair, lower), _shuffle(builder, *pair, upper)) for pair in pairs]
        half //= 2
    return rows[0]


for _function, _name in zip(_ARITHMETIC, 2 * ("fadd", "fsub", "fmul"), strict=True):
    _define(_function, _LANES, _Type, _Type)(
        lambda _, builder, __, one, other, name=_name: getattr(builder, name)(one, other)
    )
