"""Labelled arrays as files: NetCDF for Python, Julia and R, MAT for MATLAB and Octave."""

from __future__ import annotations

import re
import secrets
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.show.output import OutputError, replacing

if TYPE_CHECKING:
    import xarray as xr

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


def write_zarr(path: Path, dataset: xr.Dataset) -> None:
    """Write a dataset as a zarr folder (version 2, which knows texts), whole or not at all.

    path    where nothing is yet
    Raises  OutputError  where it cannot be written
    """
    with new_folder(path) as draft:
        dataset.to_zarr(draft, mode="w", zarr_format=2, consolidated=True)


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
    from scipy.io import savemat

    arrays: dict[str, Any] = {_matlab_name(str(name)): _cells(v.values) for name, v in dataset.variables.items()}
    about = {
        _matlab_name(str(name)): _struct({"axes": " ".join(map(str, v.dims)), **v.attrs})
        for name, v in dataset.variables.items()
    }
    arrays |= {"about": _struct(dataset.attrs), "about_variables": about}
    savemat(draft, arrays, long_field_names=True, oned_as="column")
    with open(draft, "r+b") as file:  # the date of the day would stand there
        file.write(b"MATLAB 5.0 MAT-file, written by zwidth".ljust(HEADER))


def _struct(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    return {_matlab_name(str(key)): value for key, value in attributes.items()}


def _matlab_name(name: str) -> str:
    """A name that MATLAB takes."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    plain = plain if plain[:1].isalpha() else f"n_{plain}"
    if len(plain) > LONGEST_NAME:
        raise OutputError(f"{name}: is too long a name for MATLAB, which takes {LONGEST_NAME} letters; write .nc")
    return plain


def _cells(values: np.ndarray) -> np.ndarray:
    """Texts as a cell array."""
    return values.astype(object) if values.dtype.kind in "UT" else values


_WRITERS: Final = {".nc": _netcdf, ".mat": _matlab}
