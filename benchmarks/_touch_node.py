"""Run the contact kernel's WebAssembly in Node, on the blocks that Python fills."""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from zwidth.contact import OUTPUTS, TouchNumbers

WASM = Path(__file__).parents[1] / "src" / "zwidth" / "show" / "app" / "page" / "touch.wasm"
PROGRAM = """
const fs = require("fs"), {wasm, folder, periods, chunk, repeats} = JSON.parse(process.argv[1]);
const module = new WebAssembly.Module(fs.readFileSync(wasm));
const {memory, touch_periods, __heap_base} = new WebAssembly.Instance(module).exports;
const names = ["counts", "numbers", "memory", "ports", "noise"];
const data = Object.fromEntries(names.map(name => [name, fs.readFileSync(`${folder}/${name}`)]));
const at = {};
let end = (__heap_base.value + 15) & ~15;
for (const name of [...names, "outputs"]) {
  at[name] = end;
  end += name == "outputs" ? periods * OUTPUTS * 8 : (data[name].length + 15) & ~15;
}
const missing = Math.ceil((end - memory.buffer.byteLength) / 65536);
if (missing > 0) memory.grow(missing);
const bytes = new Uint8Array(memory.buffer), width = data.noise.length / periods;
let nanoseconds = Infinity;
for (let repeat = 0; repeat < repeats; repeat++) {
  for (const name of names) bytes.set(data[name], at[name]);
  const begun = process.hrtime.bigint();
  for (let j = 0; j < periods; j += chunk)
    touch_periods(at.counts, at.numbers, at.memory, at.ports, at.noise + width * j,
                  at.outputs + 8 * OUTPUTS * j, Math.min(chunk, periods - j));
  nanoseconds = Math.min(nanoseconds, Number(process.hrtime.bigint() - begun) / periods);
}
fs.writeFileSync(`${folder}/outputs`, bytes.slice(at.outputs, at.outputs + periods * OUTPUTS * 8));
fs.writeFileSync(`${folder}/memory`, bytes.slice(at.memory, at.memory + data.memory.length));
const imports = WebAssembly.Module.imports(module), exports = WebAssembly.Module.exports(module);
console.log(JSON.stringify({nanoseconds, imports, exports: exports.map(each => each.name)}));
""".replace("OUTPUTS", str(OUTPUTS))


def run_in_node(
    device: TouchNumbers,
    ports: np.ndarray,
    noise: np.ndarray,
    periods: int,
    *,
    chunk: int | None = None,
    repeats: int = 1,
    wasm: Path = WASM,
) -> tuple[np.ndarray, np.ndarray, dict]:
    """Several periods from the device's start.

    ports, noise  blocks as `touch_periods` takes them;   chunk  periods in a call; None: all
    repeats       of the same run, of which the fastest is told
    Returns       outputs (S, OUTPUTS), memory afterwards, and nanoseconds per period, imports and exports by name
    """
    with tempfile.TemporaryDirectory() as folder:
        blocks = {name: getattr(device, name) for name in ("counts", "numbers", "memory")}
        for name, block in (blocks | {"ports": ports, "noise": noise}).items():
            (Path(folder) / name).write_bytes(np.ascontiguousarray(block).tobytes())
        task = {"wasm": str(wasm), "folder": folder, "periods": periods, "chunk": chunk or periods}
        command = ["node", "-e", PROGRAM, json.dumps(task | {"repeats": repeats})]
        told = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        outputs, memory = (np.fromfile(Path(folder) / name) for name in ("outputs", "memory"))
    return outputs.reshape(periods, OUTPUTS), memory, told
