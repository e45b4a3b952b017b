"""Build a wheel that carries the machine code of all kernels, so that nothing is compiled at first use.

    python tools/build_wheel.py [FOLDER]        into dist/, for this Python and this platform

An ordinary wheel is built by pip. Its kernels are then compiled for a generic processor of the platform, by the
Python that runs this script, and packed in beside the sources (`zwidth.machine_code` reads them). Machine code
can be read only by the release of numba that made it, and so the wheel requires that release. With another one
installed all the same, kernels are compiled at first use as in a clone.
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from importlib.metadata import distribution, version
from pathlib import Path

ROOT = Path(__file__).parent.parent


def main(folder: Path) -> Path:
    """Build the wheel into the folder; returns its path."""
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary)
        run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", work / "plain", ROOT)
        (plain,) = (work / "plain").glob("*.whl")
        with zipfile.ZipFile(plain) as archive:
            archive.extractall(work / "content")
        content = work / "content"
        compile_into(content / "zwidth" / "kernels", content, work)
        tags = wheel_tags()
        (metadata,) = content.glob("*.dist-info")
        edit(metadata / "METADATA", r"(?m)^(Requires-Dist: numba)\b.*$", rf"\1=={version('numba')}")
        edit(metadata / "WHEEL", r"(?m)^Root-Is-Purelib: true$", "Root-Is-Purelib: false")
        edit(metadata / "WHEEL", r"(?m)^Tag: .*\n", "".join(f"Tag: {tag}\n" for tag in tags))
        write_record(content, metadata)
        folder.mkdir(parents=True, exist_ok=True)
        platforms = ".".join(tag.split("-")[2] for tag in tags)
        name = "-".join(plain.name.split("-")[:2] + tags[0].split("-")[:2] + [platforms])
        wheel = folder / f"{name}.whl"
        pack(content, wheel)
    return wheel


def run(*command: str | Path, **environment: str) -> None:
    """Run a command in this environment with these variables added; ends the script if it fails."""
    subprocess.run([str(word) for word in command], check=True, env={**os.environ, **environment})


def compile_into(kernels: Path, content: Path, work: Path) -> None:
    """Compile all kernels of the unpacked wheel for a generic processor."""
    settings = {
        "NUMBA_CPU_NAME": "generic",
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_CACHE_DIR": str(work / "cache"),
        "PYTHONPATH": str(content),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    run(sys.executable, "-m", "zwidth", "compile", **settings)
    (work / "cache" / "zwidth" / "kernels").rename(kernels)


def wheel_tags() -> list[str]:
    """Tags of this Python on the platforms of llvmlite's own wheel: machine code runs on the same ones."""
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    platforms = re.findall(r"(?m)^Tag: \S+?-\S+?-(\S+)$", distribution("llvmlite").read_text("WHEEL") or "")
    return [f"{python}-{python}-{platform}" for platform in sorted(set(platforms))]


def edit(file: Path, pattern: str, text: str) -> None:
    """Replace the first match of a pattern by a text and remove the others; ends the script if there is none."""
    old = file.read_text(encoding="utf-8")
    first = re.search(pattern, old)
    if first is None:
        raise SystemExit(f"{file.name} has no {pattern}")
    rest = re.sub(pattern, "", old[first.end() :])
    file.write_text(old[: first.start()] + first.expand(text) + rest, encoding="utf-8")


def write_record(content: Path, metadata: Path) -> None:
    """Write RECORD: every file with its digest and size, as pip checks them."""
    record = metadata / "RECORD"
    lines = []
    for file in sorted(path for path in content.rglob("*") if path.is_file() and path != record):
        data = file.read_bytes()
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        lines.append(f"{file.relative_to(content).as_posix()},sha256={digest},{len(data)}")
    lines.append(f"{record.relative_to(content).as_posix()},,")
    record.write_text("\n".join(lines) + "\n", encoding="utf-8")


def pack(content: Path, wheel: Path) -> None:
    """Zip the files, with a fixed date: the same content gives the same file."""
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(path for path in content.rglob("*") if path.is_file()):
            entry = zipfile.ZipInfo(file.relative_to(content).as_posix(), (2020, 1, 1, 0, 0, 0))
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, file.read_bytes())


if __name__ == "__main__":
    print(main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "dist"))
