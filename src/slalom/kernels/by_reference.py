"""Tables by reference: a kernel passes one pointer in place of the numbers of all arrays of a table.

numba passes an array as seven numbers or more, and a table as the numbers of all its arrays: more than 300 for the
tables of a decision. A table by reference is put into the memory of a kernel once. The kernels that it calls get the
address, and read only the fields that they need.
"""

import hashlib
from collections.abc import Callable
from typing import Any, TypeVar

from numba.core import cgutils, config, types
from numba.core.imputils import impl_ret_borrowed, impl_ret_untracked
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_builtin,
    lower_getattr_generic,
    models,
    register_model,
    type_callable,
)

from slalom.kernels.arrays import Corners, Hulls

T = TypeVar("T")

BY_VALUE = (Corners, Hulls)
"""Tables that stay values: numba drops branches on the length of a tuple, see `arrays.MaybeHulls`."""


def by_reference(table: T) -> T:
    """In kernels a reference to the `table`, an argument of the kernel; in Python the table itself.

    The caller of a kernel holds the arrays of its arguments until the kernel returns. A reference to another table
    would not hold them. Arrays that are read from it are not counted, so a kernel that returns an array must not return
    one of these.
    """
    return table


class TableReference(types.Type):
    """The type of a reference to a table. A field that is a table is a reference too, unless it is BY_VALUE."""

    def __init__(self, table: Any) -> None:
        self.table = table
        # Names of types are parts of the names of functions: those of tables have thousands of letters.
        digest = hashlib.sha256(str(table).encode()).hexdigest()[:16]
        super().__init__(name=f"TableReference({self.table.instance_class.__name__}, {digest})")

    @property
    def key(self) -> Any:
        return self.table

    def field(self, name: str) -> tuple[int, Any]:
        """The number and the type of a field."""
        number = self.table.fields.index(name)
        ty = tuple(self.table)[number]
        return number, TableReference(ty) if is_table(ty) else ty


def is_table(ty: Any) -> bool:
    """Whether a type is that of a table that is passed by reference."""
    return isinstance(ty, types.BaseNamedTuple) and ty.instance_class not in BY_VALUE  # type: ignore[attr-defined]


def uncounted(context: Any, builder: Any, ty: Any, value: Any) -> Any:
    """The value, all arrays in it without the counter of references that belongs to them.

    A reference costs as much as ten additions, since threads may count at the same time.
    """
    if isinstance(ty, types.Array):
        array = context.make_array(ty)(context, builder, value=value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)  # type: ignore[no-untyped-call]
        return array._getvalue()
    if isinstance(ty, types.BaseTuple):
        for k, one in enumerate(ty):  # type: ignore[arg-type, var-annotated]
            part = uncounted(context, builder, one, builder.extract_value(value, k))
            value = builder.insert_value(value, part, k)
    return value


@register_model(TableReference)
class _Address(models.PrimitiveModel):
    """The address of the table in memory."""

    def __init__(self, manager: Any, reference: TableReference) -> None:
        table = manager.lookup(reference.table).get_value_type()
        super().__init__(manager, reference, table.as_pointer())  # type: ignore[no-untyped-call]


@type_callable(by_reference)
def _type_of_reference(_context: Any) -> Callable[[Any], Any]:
    def reference(table: Any) -> Any:
        if isinstance(table, TableReference):
            return table
        return TableReference(table) if is_table(table) else None

    return reference


@lower_builtin(by_reference, types.BaseNamedTuple)  # type: ignore[no-untyped-call, untyped-decorator]
def _put_into_memory(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    place = cgutils.alloca_once(builder, arguments[0].type)  # type: ignore[no-untyped-call]
    builder.store(arguments[0], place)
    return impl_ret_untracked(context, builder, signature.return_type, place)  # type: ignore[no-untyped-call]


@lower_builtin(by_reference, TableReference)  # type: ignore[no-untyped-call, untyped-decorator]
def _same(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return impl_ret_untracked(context, builder, signature.return_type, arguments[0])  # type: ignore[no-untyped-call]


@infer_getattr
class _Fields(AttributeTemplate):
    key = TableReference

    def generic_resolve(self, reference: TableReference, name: str) -> Any:  # type: ignore[override]
        return reference.field(name)[1] if name in reference.table.fields else None


@lower_getattr_generic(TableReference)  # type: ignore[no-untyped-call, untyped-decorator]
def _read_field(context: Any, builder: Any, reference: TableReference, address: Any, name: str) -> Any:
    number, ty = reference.field(name)
    place = cgutils.gep_inbounds(builder, address, 0, number)  # type: ignore[no-untyped-call]
    if isinstance(ty, TableReference):
        return impl_ret_untracked(context, builder, ty, place)  # type: ignore[no-untyped-call]
    value = uncounted(context, builder, ty, builder.load(place))
    return impl_ret_borrowed(context, builder, ty, value)  # type: ignore[no-untyped-call]


# Tables that stay in memory from call to call: one kernel decides for many of them, and Python passes addresses.
#
# The caller holds the arrays of a table as long as its address is used.


def in_kernels(in_python: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """Make a function of kernels, without the argument of its context; `in_python`: where kernels run as Python."""
    return lambda function: in_python if config.DISABLE_JIT else intrinsic(function)  # type: ignore[attr-defined]


KEPT: dict[int, Any] = {}  # tables by their addresses, where kernels run as Python


@in_kernels(tuple.__sizeof__)
def size_of(_context: Any, table: Any) -> Any:
    """In kernels: the bytes that a `table` takes in memory."""

    def code(context: Any, _builder: Any, signature: Any, _arguments: Any) -> Any:
        size = context.get_abi_sizeof(context.get_value_type(table))
        return context.get_constant(types.int64, size)

    return types.int64(table), code


@in_kernels(KEPT.__setitem__)
def put_table(_context: Any, address: Any, table: Any) -> Any:
    """In kernels: write a `table` to an `address`, at which `size_of` bytes are free."""

    def code(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        place = builder.inttoptr(arguments[0], context.get_value_type(table).as_pointer())
        builder.store(arguments[1], place)
        return context.get_dummy_value()

    return types.void(types.int64, table), code


@in_kernels(lambda address, _like: KEPT[address])
def table_at(_context: Any, address: Any, like: Any) -> Any:
    """In kernels: a reference to the table at an `address`, of the type of the table `like`."""
    reference = like if isinstance(like, TableReference) else TableReference(like)

    def code(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(reference))

    return reference(types.int64, like), code


@in_kernels(lambda t, now, at: t._replace(settings=t.settings._replace(now=now), bodies=t.bodies._replace(now=at)))
def at_times(_context: Any, tables: Any, now: Any, begin: Any) -> Any:
    """In kernels: `tables` by reference, with `now` in the field `now` of the settings, `begin` in that of bodies."""

    def code(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        for part, time in zip(("settings", "bodies"), arguments[1:]):
            number, reference = tables.field(part)
            place = cgutils.gep_inbounds(builder, arguments[0], 0, number, reference.field("now")[0])  # type: ignore[no-untyped-call]
            builder.store(time, place)
        return arguments[0]

    return tables(tables, types.float64, types.float64), code
