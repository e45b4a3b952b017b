"""Tuples of arrays that one kernel hands to another as one address.

Numba hands a tuple over as all its numbers, one after the other: seven for each array, three hundred for the
working memory of a chart, taken apart and put together again at each call. Translating that takes longer than
translating what the kernels compute. Here the tuple is written to the caller's stack once, and the kernels below
it are handed its address; they read from there the fields that they name, and cannot change them.
"""

from __future__ import annotations

from hashlib import blake2b
from typing import Any, Final

from numba import types
from numba.core import cgutils
from numba.core.datamodel import models, registry
from numba.core.imputils import impl_ret_borrowed, lower_cast, lower_getattr_generic
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AttributeTemplate, infer_getattr

FEWEST_ARRAYS: Final = 3  # a tuple of fewer arrays is handed over as it is


class TupleReference(types.Type):
    """Type of the address of a named tuple.

    fields  numba's type of the tuple
    """

    def __init__(self, fields: types.BaseNamedTuple) -> None:
        self.fields = fields
        digest = blake2b(str(fields).encode(), digest_size=6).hexdigest()
        super().__init__(name=f"TupleReference({fields.instance_class.__name__}, {digest})")

    @property
    def key(self) -> types.BaseNamedTuple:
        """The type of the tuple, by which numba tells such types apart."""
        return self.fields

    def unify(self, context: Any, other: types.Type) -> types.Type | None:
        """Type of a variable that is now such an address and now the tuple itself: the tuple."""
        return self.fields if other == self.fields else None

    def can_convert_to(self, context: Any, other: types.Type) -> Conversion | None:
        """How numba may convert the address: safely to its own tuple; None: not to another type."""
        return Conversion.safe if other == self.fields else None


def handed_over(kind: types.Type) -> types.Type:
    """Type by which a kernel takes an argument of this type from another kernel."""
    if isinstance(kind, types.BaseNamedTuple) and _arrays(kind) >= FEWEST_ARRAYS:
        return TupleReference(kind)
    return kind


class TakesAddresses:
    """Part of numba's dispatcher of a kernel that others call, on any processor: tuples come as addresses."""

    def get_call_template(self, arguments: Any, keywords: Any) -> Any:
        """Types of the arguments of a call; numba would give each number written in the call a type of its own."""
        plain = {name: handed_over(types.unliteral(kind)) for name, kind in keywords.items()}
        given = tuple(handed_over(types.unliteral(kind)) for kind in arguments)
        return super().get_call_template(given, plain)  # type: ignore[misc]


def check_returned_address(kernel: str, kind: types.Type) -> None:
    """Raise TypeError if a kernel returns a tuple that was handed to it.

    What stands at that address may be another tuple by the time its caller reads it.
    """
    if isinstance(kind, TupleReference):
        raise TypeError(f"kernel {kernel} returns a tuple of arrays that it was given; return what is in it")
    if isinstance(kind, types.BaseTuple):
        for part in kind:
            check_returned_address(kernel, part)


def _arrays(kind: types.Type) -> int:
    """How many arrays a tuple holds, those of tuples within it too."""
    if isinstance(kind, types.BaseTuple):
        return sum(_arrays(part) for part in kind)
    return int(isinstance(kind, types.Array))


@registry.register_default(TupleReference)
class _TupleReferenceModel(models.PrimitiveModel):
    """An address."""

    def __init__(self, manager: Any, kind: TupleReference) -> None:
        super().__init__(manager, kind, cgutils.voidptr_t)


@lower_cast(types.BaseNamedTuple, TupleReference)
def _write(context: Any, builder: Any, kind: types.Type, reference: TupleReference, value: Any) -> Any:
    """Code that writes a tuple to the stack; returns its address."""
    return builder.bitcast(cgutils.alloca_once_value(builder, value), cgutils.voidptr_t)


@lower_cast(TupleReference, types.BaseNamedTuple)
def _read_whole(context: Any, builder: Any, reference: TupleReference, kind: types.Type, address: Any) -> Any:
    """Code that reads the whole tuple at an address."""
    place = builder.bitcast(address, context.get_value_type(kind).as_pointer())
    return impl_ret_borrowed(context, builder, kind, builder.load(place))


@infer_getattr
class _FieldType(AttributeTemplate):
    """Type of a field."""

    key = TupleReference

    def generic_resolve(self, reference: TupleReference, name: str) -> types.Type | None:
        """Type of a field by its name, as a kernel gets it; None where the tuple has no such field."""
        if name not in reference.fields.fields:
            return None
        return handed_over(reference.fields[reference.fields.fields.index(name)])


@lower_getattr_generic(TupleReference)
def _read(context: Any, builder: Any, reference: TupleReference, address: Any, name: str) -> Any:
    """Code that reads a field by its name: what stands there, or the address of a tuple within the tuple.

    context, builder  of numba and LLVM;   address  of the tuple
    """
    index = reference.fields.fields.index(name)
    kind = reference.fields[index]
    # by the distance in bytes: the type of the whole tuple, written out, has thousands of characters
    whole, data = context.get_value_type(reference.fields), context.target_data
    if isinstance(reference.fields, types.NamedUniTuple):
        offset = index * context.get_value_type(kind).get_abi_size(data)
    else:
        offset = whole.get_element_offset(data, index)
    place = builder.gep(address, [cgutils.intp_t(offset)], inbounds=True)
    if isinstance(handed_over(kind), TupleReference):
        return place
    place = builder.bitcast(place, context.get_value_type(kind).as_pointer())
    return impl_ret_borrowed(context, builder, kind, builder.load(place))
