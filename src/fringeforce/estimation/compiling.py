"""How loops are compiled, so that the first use of a machine waits no longer than it must.

Most of that time goes into what surrounds a function: a door for Python, which unpacks some fifty
arrays, and the code of all that it calls, which is made again for every caller.  So what is long is
compiled `apart`, once, and its callers jump there; named tuples of arrays they hand over as one
address, for taking fifty arrays out and putting them in again is most of what a small function is.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding as llvm
from numba import config, njit, types
from numba.core import cgutils
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.imputils import impl_ret_borrowed, impl_ret_new_ref
from numba.core.typing import signature
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    models,
    register_model,
)


class _Results(CompileResultCacheImpl):
    """What a cache keeps of a function.

    Numba forgets, of one that was loaded, what must be at its symbol before it runs; a caller that
    takes it in and is kept itself would then jump to nothing in the next process.

    Beside what runs it keeps the bitcode that such a caller takes in, which most processes never
    need: it is read when the first one asks for it.
    """

    door = True
    """Whether Python can call the function."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        told = _sources(function.__module__)
        self._locator.get_source_stamp = lambda: told

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """The function, from what was kept."""
        (name, kind, (code, bitcode)), described, *others = payload
        known = target_context.codegen()._engine._defined_symbols
        known.add(described.llvm_func_name)
        if self.door:
            known.add(described.llvm_cpython_wrapper_name)
        payload = ((name, kind, (code, _nothing())), described, *others)
        found = super().rebuild(target_context, payload)
        found.library._reload_init.update(found.reload_init or ())

        @cache
        def taken_in() -> Any:
            module = llvm.parse_bitcode(bitcode)
            for there in (module.functions, module.global_variables):
                known.update(one.name for one in there if not one.is_declaration)
            return module

        found.library._get_module_for_linking = taken_in
        return found


@cache
def _sources(module: str) -> str:
    """A digest of the source of a module and of all that it imports from its own package.

    Numba looks at the file of a function alone, and would keep what it took in from others.
    """
    found, left, package = dict[str, bytes](), {module}, module.partition(".")[0]
    while left:
        name = left.pop()
        source = Path(inspect.getfile(import_module(name))).read_bytes()
        found[name] = source
        named = re.findall(rb"^from ([\w.]+) import", source, re.MULTILINE)
        own = {one.decode() for one in named if one.partition(b".")[0].decode() == package}
        left |= own - found.keys()
    return sha256(b"".join(found[name] for name in sorted(found))).hexdigest()


@cache
def _nothing() -> bytes:
    """Bitcode without anything in it."""
    return llvm.parse_assembly("").as_bitcode()


class _Cache(FunctionCache):
    _impl_class = _Results


def _compiler(**how: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator that compiles a function, and keeps it for other processes."""

    def compiled(function: Callable[..., Any]) -> Any:
        found = njit(error_model="numpy", **how)(function)
        if not config.DISABLE_JIT:  # pyrefly: ignore[missing-attribute]
            found._cache = _Cache(found.py_func)
            found._cache._impl.door = not how.get("no_cpython_wrapper", False)
        return found

    return compiled


_DOORLESS: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}

_DOOR: dict[str, Any] = {"nogil": True, "no_cfunc_wrapper": True}

entry = _compiler(**_DOOR)
"""Compiles what Python calls."""
inner = _compiler(**_DOORLESS)
"""Compiles what only compiled functions call: it has no door, and Python that calls it crashes."""
part = njit(error_model="numpy", inline="always")
"""Makes what is tiny, or called from one place only, a part of its callers."""

_REORDERED: Any = {"reassoc", "contract", "arcp", "nsz"}
"""Freedom to reorder sums, so that they run in vector units; not-a-number keeps its meaning."""
sums_entry = _compiler(fastmath=_REORDERED, **_DOOR)
"""Compiles what Python calls and what consists of sums."""
sums = _compiler(fastmath=_REORDERED, **_DOORLESS)
"""Compiles what only such functions call."""


class _Lent(types.Type):
    """A record that a caller keeps: what it calls gets its address, and takes what it needs."""

    def __init__(self, record: Any) -> None:
        self.record = record
        super().__init__(f"lent({record})")

    def field(self, name: str) -> tuple[int, Any]:
        """Where a field stands, and its type."""
        place = self.record.fields.index(name)
        return place, _lent(self.record[place])


def _lent(given: Any) -> Any:
    """The type that a callee gets for one that its caller has."""
    return _Lent(given) if isinstance(given, types.BaseNamedTuple) else given


@register_model(_Lent)
class _Address(models.PrimitiveModel):
    def __init__(self, manager: Any, lent: _Lent) -> None:
        super().__init__(manager, lent, manager[lent.record].get_data_type().as_pointer())


@infer_getattr
class _Fields(AttributeTemplate):
    key = _Lent

    def generic_resolve(self, lent: _Lent, name: str) -> Any:
        return lent.field(name)[1] if name in lent.record.fields else None


@lower_getattr_generic(_Lent)
def _take(context: Any, builder: Any, lent: _Lent, address: Any, name: str) -> Any:
    """The instructions that take a field; no lent record changes, so that loops take it once."""
    place, own = lent.field(name)
    found = cgutils.gep_inbounds(builder, address, 0, place)
    if isinstance(own, _Lent):
        return found
    found, model = builder.load(found), context.data_model_manager[own]
    found.set_metadata("invariant.load", builder.module.add_metadata([]))
    if model.get_value_type() != model.get_data_type():  # a truth value fills a byte
        found = model.from_data(builder, found)
    return impl_ret_borrowed(context, builder, own, found)


def _keep(context: Any, builder: Any, record: Any, value: Any, address: Any) -> None:
    """The instructions that lay a record out where it can be lent."""
    for place, own in enumerate(record):
        field, there = (
            builder.extract_value(value, place),
            cgutils.gep_inbounds(builder, address, 0, place),
        )
        model = context.data_model_manager[own]
        if isinstance(own, types.BaseNamedTuple):
            _keep(context, builder, own, field, there)
        elif model.get_value_type() == model.get_data_type():
            builder.store(field, there)
        else:
            builder.store(model.as_data(builder, field), there)


class _Compiled(NamedTuple):
    """A function at the top of a module that is compiled apart, for arguments of such types."""

    module: str
    name: str
    types: tuple[Any, ...]

    @property
    def symbol(self) -> str:
        """What callers jump to, in every process."""
        own = sha256(repr(self.types).encode()).hexdigest()
        return f"{self.module}.{self.name}.{own[:32]}"

    def __call__(self) -> Any:
        """Have it at its symbol, compiled or loaded; Numba calls this before it loads a caller."""
        loop = getattr(import_module(self.module), self.name).loop
        loop.compile(self.types)
        found = loop.overloads[self.types]
        code = found.library.get_pointer_to_function(found.fndesc.llvm_func_name)
        llvm.add_symbol(self.symbol, code)
        return found

    def jump(self, context: Any, builder: Any, signature: Any, values: Any) -> Any:
        """The instructions that call it."""
        convention, returned, given = context.call_conv, signature.return_type, list(values)
        for k, (own, wanted) in enumerate(zip(signature.args, self.types, strict=True)):
            if own != wanted:
                room = context.data_model_manager[own].get_data_type()
                given[k] = cgutils.alloca_once(builder, room)
                _keep(context, builder, own, values[k], given[k])
        code = cgutils.get_or_insert_function(
            builder.module, convention.get_function_type(returned, self.types), self.symbol
        )
        context.active_code_library._reload_init.add(self)
        status, value = convention.call_function(builder, code, returned, self.types, given)
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return impl_ret_new_ref(context, builder, returned, value)


def apart(function: Callable[..., Any]) -> Any:
    """Compile what is long and consists of sums once, whatever the number of its callers.

    Numba would make its code, and that of all that it calls, again for every caller.  Only compiled
    functions can call it.

    Parameters
    ----------
    function : callable
        At the top of its module, with arguments that have no defaults.

    Returns
    -------
    callable
        What compiled functions call.
    """
    if config.DISABLE_JIT:  # pyrefly: ignore[missing-attribute]
        return function

    def typed(context: Any, *given: Any) -> Any:
        own = tuple(_lent(one) for one in given)
        compiled = _Compiled(function.__module__, function.__name__, own)
        return signature(compiled().signature.return_type, *given), compiled.jump

    own = inspect.signature(function).parameters.values()
    context = inspect.Parameter("context", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    typed.__signature__ = inspect.Signature([context, *own])  # pyrefly: ignore[missing-attribute]
    typed.__name__ = function.__name__
    found = intrinsic(typed)
    found.loop, found.py_func = sums(function), function  # pyrefly: ignore[missing-attribute]
    return found


@sums
def copied(line, out):
    """Copy a line into another of its length.

    `out[:] = line` would compile into every caller the words of an error for unlike shapes, and
    whatever copies lines that overlap: that doubles the time of small functions.
    """
    for k in range(len(out)):
        out[k] = line[k]
