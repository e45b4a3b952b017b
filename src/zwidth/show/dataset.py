"""Labelled arrays as files: NetCDF for Python, Julia and R, MAT for MATLAB and Octave.

A study's results as files that are written piece by piece, so that they may be larger than the memory.
"""

from __future__ import annotations

import re
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.errors import OutputError
from zwidth.show.output import csv_text, replacing
from zwidth.study.designs.sweep import (
    DESIGN,
    column_attributes,
    coordinates,
    dataset_attributes,
    status_flags,
    table_pieces,
)

if TYPE_CHECKING:
    import xarray as xr

    from zwidth.study.designs.sweep import Sweep


HEADER: Final = 116  # bytes of text that a MAT file begins with
LONGEST_NAME: Final = 63  # letters of a name in MATLAB


def write_dataset(path: Path, dataset: xr.Dataset) -> None:
    """Write a dataset as .nc or .mat, whole or not at all, the same bytes from the same numbers.

    .nc   NetCDF 3 (classic, 64-bit offsets), which every reader opens. It knows no unsigned and no long integers:
          uint8 is written as int16, int64 as int32
    .mat  MATLAB 5: a variable for each variable and coordinate, with the dataset's axes in their order; what is
          said about them in the structs `about` (of the whole) and `about_variables`

    Attributes may be text, numbers, and lists of numbers.
    Raises  ValueError   for another ending
            OutputError  where the file cannot be written, or a name is too long for MATLAB
    """
    kind = path.suffix.lower()
    if kind not in _WRITERS:
        raise ValueError(f"a dataset is written as {', '.join(_WRITERS)}, got '{path.name}'; change the extension")
    with replacing(path) as draft:
        _WRITERS[kind](draft, dataset)


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """A folder to be filled inside this block, which then gets its name; nothing is left of it where that fails.

    path    where nothing is yet
    Raises  OutputError  where it cannot be written
    """
    draft = path.with_name(f".{path.stem[:40]}-{secrets.token_hex(4)}{path.suffix}")
    try:
        yield draft
        draft.rename(path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"{path}: cannot be written: {reason[:1].lower() + reason[1:]}; name another") from None
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _netcdf(draft: Path, dataset: xr.Dataset) -> None:
    """Write the dataset as NetCDF 3, which has no uint8: as int16 in variables and in their attributes."""
    signed = dataset.copy()
    for name, variable in dataset.variables.items():
        if variable.dtype == np.uint8:
            attributes = {
                key: value.astype(np.int16) if getattr(value, "dtype", None) == np.uint8 else value
                for key, value in variable.attrs.items()
            }
            signed[name] = variable.astype(np.int16)
            signed[name].attrs = attributes
    signed.to_netcdf(draft, engine="scipy", format="NETCDF3_64BIT")


def _matlab(draft: Path, dataset: xr.Dataset) -> None:
    """Write the dataset as a MAT file, with a header that does not change from day to day."""
    from scipy.io import savemat

    arrays: dict[str, Any] = {
        _matlab_name(str(name)): _matlab_values(v.values) for name, v in dataset.variables.items()
    }
    about = {
        _matlab_name(str(name)): _struct({"axes": " ".join(map(str, v.dims)), **v.attrs})
        for name, v in dataset.variables.items()
    }
    arrays |= {"about": _struct(dataset.attrs), "about_variables": about}
    savemat(draft, arrays, long_field_names=True, oned_as="column")
    with open(draft, "r+b") as file:  # the date of the day would stand there
        file.write(b"MATLAB 5.0 MAT-file, written by zwidth".ljust(HEADER))


def _struct(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Attributes under names that MATLAB takes, which `savemat` writes as a struct."""
    return {_matlab_name(str(key)): value for key, value in attributes.items()}


def _matlab_name(name: str) -> str:
    """The name in letters, digits and _, a letter first. Raises OutputError for one too long for MATLAB."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    plain = plain if plain[:1].isalpha() else f"n_{plain}"
    if len(plain) > LONGEST_NAME:
        raise OutputError(f"{name}: is too long a name for MATLAB, which takes {LONGEST_NAME} letters; write .nc")
    return plain


def _matlab_values(values: np.ndarray) -> np.ndarray:
    """The array as MATLAB takes it: texts as objects, which become a cell array."""
    return values.astype(object) if values.dtype.kind in "UT" else values


_WRITERS: Final = {".nc": _netcdf, ".mat": _matlab}


CHUNK: Final = 1 << 16  # designs in each chunk of a zarr folder, at most
Columns = Mapping[str, Sequence[Any]]


def write_sweep_csv(path: Path, sweep: Sweep, renamed: Callable[[Any], Any] = dict) -> None:
    """Write a study's designs as a table, one a row, whole or not at all.

    renamed  takes the columns of a piece, name -> values, and returns them under the names of the file
    Raises   OutputError  where the file cannot be written
    """
    with replacing(path) as draft, open(draft, "w", encoding="utf-8", newline="\n") as file:
        header = ""
        for piece in table_pieces(sweep):
            columns: Columns = renamed(piece)
            if not header:
                header = csv_text({name: [] for name in columns})
                file.write(header)
            file.write(csv_text(columns)[len(header) :])


def write_sweep_zarr(path: Path, sweep: Sweep) -> None:
    """Write a study's dataset as a zarr folder (version 2, which knows texts), whole or not at all.

    It holds what `Sweep.dataset` has, and xarray opens it.
    path    where nothing is yet
    Raises  OutputError  where it cannot be written
    """
    import xarray as xr
    import zarr

    with new_folder(path) as draft:
        is_grid = sweep.job.sampling.kind == "grid"
        along = coordinates(sweep, 0, 0 if not is_grid else sweep.job.count) if is_grid else {}
        xr.Dataset(coords=along, attrs=dataset_attributes(sweep)).to_zarr(
            draft, mode="w", zarr_format=2, consolidated=False
        )
        group = zarr.open_group(str(draft), mode="r+", zarr_format=2)
        if not is_grid:
            _write_coordinates(group, sweep)
        _write_columns(group, sweep)
        zarr.consolidate_metadata(str(draft), zarr_format=2)


def _write_columns(group: Any, sweep: Sweep) -> None:
    """Write the values and the status of each measure into the folder `group`, over the axes of the study."""
    sampling = sweep.job.sampling
    shape = sampling.shape
    dims = [axis.key for axis in sampling.axes] if sampling.kind == "grid" else [DESIGN]
    chunks = _chunks(shape)
    arrays = []
    for n, one in enumerate(sweep.job.columns):
        attributes = column_attributes(sweep, n)
        values = _array(group, one.name, shape, chunks, np.dtype(np.float64), np.nan, dims, attributes)
        # arrays among the attributes become lists, for JSON
        flags = {key: getattr(value, "tolist", lambda v=value: v)() for key, value in status_flags().items()}
        status = _array(group, f"{one.name}_status", shape, chunks, np.dtype(np.uint8), None, dims, flags)
        arrays.append((values, status))
    pieces = ((np.asarray(cells.values), np.asarray(cells.status)) for _, cells in sweep.cells.pieces())
    cut = _recut(pieces, _lengths(shape, chunks))
    for place, (values, status) in zip(_places(shape, chunks), cut, strict=True):
        size = tuple(part.stop - part.start for part in place)
        for n, (array_of_values, array_of_status) in enumerate(arrays):
            array_of_values[place] = values[:, n].reshape(size)
            array_of_status[place] = status[:, n].reshape(size)


def _write_coordinates(group: Any, sweep: Sweep) -> None:
    """Write the designs' settings into the folder `group`: an array (designs,) for each axis, in chunks of CHUNK.

    For designs that are listed one after the other; of a grid, the axes themselves are the coordinates.
    """
    count = sweep.job.count
    types = {name: values.dtype for name, values, _ in _coordinates_of(sweep, 0, min(count, CHUNK))}
    # texts are as long as the longest: of listed values all are looked at
    for axis in sweep.job.sampling.axes:
        if axis.values and types[axis.key].kind == "U":
            lengths = [len(str(text)) for part in _values_by_chunk(sweep, axis.key) for text in part]
            types[axis.key] = np.dtype(f"<U{max(lengths)}")
    arrays: dict[str, Any] = {}
    for first in range(0, count, CHUNK):
        last = min(first + CHUNK, count)
        for name, values, attributes in _coordinates_of(sweep, first, last):
            if name not in arrays:
                fill = np.nan if types[name].kind == "f" else None
                shape, chunks = (count,), (min(CHUNK, count),)
                arrays[name] = _array(group, name, shape, chunks, types[name], fill, [DESIGN], attributes)
            arrays[name][first:last] = values
    group.attrs["coordinates"] = " ".join(name for name in arrays if name != DESIGN)


def _coordinates_of(sweep: Sweep, first: int, last: int) -> Iterator[tuple[str, Any, Mapping[str, Any]]]:
    """Name, values (k,) and attributes of each coordinate of the designs from `first` to before `last`."""
    for name, column in coordinates(sweep, first, last).items():
        _, values, *attributes = (DESIGN, column) if name == DESIGN else column
        yield name, values, attributes[0] if attributes else {}


def _values_by_chunk(sweep: Sweep, name: str) -> Iterator[Any]:
    """The values of the axis `name`, CHUNK designs at a time."""
    for first in range(0, sweep.job.count, CHUNK):
        _, values, *_ = coordinates(sweep, first, min(first + CHUNK, sweep.job.count))[name]
        yield values


def _array(
    group: Any,
    name: str,
    shape: tuple[int, ...],
    chunks: tuple[int, ...],
    dtype: np.dtype[Any],
    fill: float | None,
    dims: Sequence[str],
    attributes: Mapping[str, Any],
) -> Any:
    """Make an array in the folder `group`, without writing any values; xarray reads the names of its axes.

    fill  value of places that are not written; None: 0 or an empty text;   dims  names of the axes
    """
    stated = {**attributes, "_ARRAY_DIMENSIONS": list(dims)}
    return group.create_array(
        name, shape=shape, chunks=chunks, dtype=dtype, fill_value=fill, attributes=stated, write_data=False
    )


def _chunks(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Chunks of consecutive designs: the last axes whole, a part of one, and single places of those before.

    >>> _chunks((3, 1000, 1000))
    (1, 65, 1000)
    """
    chunks, size = [1] * len(shape), 1
    for n in reversed(range(len(shape))):
        chunks[n] = max(1, min(shape[n], CHUNK // size))
        if chunks[n] < shape[n]:
            break
        size *= shape[n]
    return tuple(chunks)


def _places(shape: tuple[int, ...], chunks: tuple[int, ...]) -> Iterator[tuple[slice, ...]]:
    """Slices of each chunk, one along each axis, in the order of the designs.

    shape, chunks  places of the array and of a whole chunk, along each axis
    """
    counts = tuple(-(-length // chunk) for length, chunk in zip(shape, chunks, strict=True))
    for chunk_index in np.ndindex(counts):
        yield tuple(
            slice(index * chunk, min((index + 1) * chunk, length))
            for index, chunk, length in zip(chunk_index, chunks, shape, strict=True)
        )


def _lengths(shape: tuple[int, ...], chunks: tuple[int, ...]) -> Iterator[int]:
    """How many designs each chunk holds, in the order of `_places`."""
    return (prod(part.stop - part.start for part in place) for place in _places(shape, chunks))


def _recut(pieces: Iterable[tuple[Any, Any]], lengths: Iterable[int]) -> Iterator[tuple[Any, Any]]:
    """Cut consecutive rows of two arrays, given in pieces, into parts of these lengths.

    pieces  pairs of rows of the values and as many of the status; yielded are such pairs, each of one length
    """
    coming = iter(pieces)
    pending: list[tuple[Any, Any]] = []
    for length in lengths:
        while sum(len(values) for values, _ in pending) < length:
            pending.append(next(coming))
        values, status = (np.concatenate([piece[n] for piece in pending]) for n in range(2))
        yield values[:length], status[:length]
        pending = [(values[length:], status[length:])]
