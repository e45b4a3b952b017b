"""Compile the contact kernel to WebAssembly, from the source that Python compiles.

    python tools/build_touch_wasm.py [FILE]     into the page's folder

Numba translates the kernels with pointers as arguments. Everything is inlined and optimised as wasm64, for numba
lays out memory for 64-bit addresses; what is left keeps no address in memory, so that it can be emitted as wasm32.
No fused multiplications and no vectors: products and sums are rounded one by one, as on the processor. `wasm-ld`
links; the module imports nothing. The same sources and releases of numba and llvmlite give the same bytes; of
older releases the text may be none that this can be done with.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import llvmlite
import llvmlite.binding as llvm
import numba
from numba import types

from zwidth.compiled import linked_module
from zwidth.contact import touch, touch_periods

ROOT = Path(__file__).parent.parent
FILE = ROOT / "src" / "zwidth" / "show" / "app" / "page" / "touch.wasm"
WIDE = ("wasm64-unknown-unknown", "e-m:e-p:64:64-p10:8:8-p20:8:8-i64:64-i128:128-n32:64-S128")
NARROW = ("wasm32-unknown-unknown", "e-m:e-p:32:32-p10:8:8-p20:8:8-i64:64-i128:128-n32:64-S128")
INTEGERS, FLOATS = types.CPointer(types.int64), types.CPointer(types.float64)
BLOCKS = (INTEGERS, FLOATS, FLOATS, FLOATS)
EXPORTS = {"touch": (touch, BLOCKS), "touch_periods": (touch_periods, (*BLOCKS, FLOATS, FLOATS, types.int64))}
PAGES = 16  # of 64 KiB each, at the beginning; the page may grow the memory
STACK = 16384  # bytes


def main(file: Path) -> None:
    """Build the module into the file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    try:
        module = machine_code()
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[0]
        raise SystemExit(
            f"numba {numba.__version__} with llvmlite {llvmlite.__version__} does not translate the kernels for "
            f"WebAssembly ({reason}); install the releases of constraints.txt"
        ) from None
    file.write_bytes(link(module))
    print(f"{file}: {file.stat().st_size} bytes")


def linker() -> list[str] | None:
    """Command of the linker: wasm-ld, or that of the ziglang wheel; None where there is neither."""
    for name in ("wasm-ld", "wasm-ld-19", "wasm-ld-18", "wasm-ld-17", "wasm-ld-16", "wasm-ld-15", "wasm-ld-14"):
        found = shutil.which(name)
        if found is not None:
            return [found]
    try:
        import ziglang  # noqa: F401
    except ImportError:
        return None
    return [sys.executable, "-m", "ziglang", "wasm-ld"]


def machine_code() -> bytes:
    """The exported kernels as one object file for wasm32."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    module = llvm.parse_assembly(targeted(optimised(), *NARROW))
    module.verify()
    machine = target_machine(NARROW[0])
    module.data_layout = NARROW[1]
    return bytes(machine.emit_object(module))


def target_machine(triple: str) -> Any:
    """LLVM's machine of a triple, with the instructions that every browser has."""
    options = {"cpu": "mvp", "features": "+bulk-memory,+bulk-memory-opt,+sign-ext,+mutable-globals", "opt": 3}
    return llvm.Target.from_triple(triple).create_target_machine(**options, reloc="static", codemodel="default")


def optimised() -> str:
    """Text of the exported functions with all that they call inlined, optimised for 64-bit addresses."""
    whole: Any = None
    for name, (kernel, arguments) in EXPORTS.items():
        text, function = linked_module(kernel, arguments)
        text += wrapper(name, function, arguments)
        text = re.sub(r'"(target-cpu|target-features|probe-stack)"="[^"]*"', "", targeted(text, *WIDE))
        module = llvm.parse_assembly(text)
        if whole is None:
            whole = module
        else:
            whole.link_in(module)
    for function in whole.functions:
        if not function.is_declaration and function.name not in EXPORTS:
            function.linkage = "internal"
            function.add_function_attribute("alwaysinline")
    for variable in whole.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"
    whole.verify()
    machine = target_machine(WIDE[0])
    tuning = llvm.create_pipeline_tuning_options(speed_level=3)
    tuning.loop_vectorization = tuning.slp_vectorization = False
    tuning.loop_interleaving = tuning.loop_unrolling = False
    builder = llvm.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(whole, builder)
    text = str(whole)
    kept = re.findall(r"(?m)^define [^\n]*@([\w.]+|\"[^\"]+\")\(", text)
    if set(kept) != set(EXPORTS):
        raise SystemExit(f"left over after inlining: {sorted(set(kept) - set(EXPORTS))}")
    kept_address = re.compile(r"alloca|(store|load) (ptr|\{)")
    addresses = [line for line in text.splitlines() if kept_address.search(line)]
    if addresses:
        raise SystemExit("addresses are kept in memory, whose layout differs:\n" + "\n".join(addresses))
    return text


def targeted(text: str, triple: str, layout: str) -> str:
    """Text of a module with another target."""
    text = re.sub(r'(?m)^target triple = ".*"$', f'target triple = "{triple}"', text)
    return re.sub(r'(?m)^target datalayout = ".*"$', f'target datalayout = "{layout}"', text)


def wrapper(name: str, function: str, arguments: tuple[Any, ...]) -> str:
    """An exported function that calls numba's, whose first two arguments are for a result and an error."""
    outer = ", ".join(f"{'i32' if kind is types.int64 else 'ptr'} %a{i}" for i, kind in enumerate(arguments))
    widened = [f"  %w{i} = sext i32 %a{i} to i64" for i, kind in enumerate(arguments) if kind is types.int64]
    inner = ", ".join(f"i64 %w{i}" if kind is types.int64 else f"ptr %a{i}" for i, kind in enumerate(arguments))
    body = ["  %result = alloca ptr", "  %error = alloca ptr", *widened]
    body += [f'  %status = call i32 @"{function}"(ptr %result, ptr %error, {inner})', "  ret void"]
    return f"\ndefine void @{name}({outer}) {{\n" + "\n".join(body) + "\n}\n"


def link(code: bytes) -> bytes:
    """A module that exports the kernels, its memory and where the memory is free (`__heap_base`)."""
    command = linker()
    if command is None:
        raise SystemExit("no linker for WebAssembly: install lld, or pip install ziglang")
    with tempfile.TemporaryDirectory() as temporary:
        source, result = Path(temporary) / "touch.o", Path(temporary) / "touch.wasm"
        source.write_bytes(code)
        options = ["--no-entry", "--strip-all", "--gc-sections", "--stack-first", "-z", f"stack-size={STACK}"]
        options += [f"--initial-memory={PAGES * 65536}", "--export=__heap_base"]
        options += [f"--export={name}" for name in EXPORTS]
        subprocess.run([*command, *options, str(source), "-o", str(result)], check=True)
        return result.read_bytes() + note()


def note() -> bytes:
    """A custom section that says by which releases the module was built: others may give other bytes."""
    python = ".".join(map(str, sys.version_info[:2]))
    text = f"zwidth: numba {numba.__version__}, llvmlite {llvmlite.__version__}, Python {python} ".encode()
    content = b"\x04note" + text
    assert len(content) < 128, "its length is written in one byte"
    return bytes([0, len(content)]) + content


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FILE)
