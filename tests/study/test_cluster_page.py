"""The walk-through of docs/cluster.md, command for command, on computers with addresses of their own."""

from __future__ import annotations

import os
import re
import secrets
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.cli.command_runner import run_command
from tests.study.cluster_cases import FACES_ITS_SCHEDULER, REGISTERED, wait_for

PAGE = (Path(__file__).parents[2] / "docs" / "cluster.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^```sh\n# on (\S+)\n(.+)\n```$", PAGE, re.MULTILINE)
(STUDY,) = re.findall(r"^```toml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
NETWORK = "10.77.0."
Shell = Callable[[str, str], list[str]]  # of an address and a command: the words that run it there


@contextmanager
def namespaces(addresses: list[str]) -> Iterator[Shell]:
    """A computer for each address: a network namespace, joined to the others by a bridge."""
    name = f"zw{secrets.token_hex(2)}"
    spaces = {address: f"{name}-{address.rsplit('.')[-1]}" for address in addresses}

    def ip(*words: str) -> None:
        subprocess.run(["ip", *words], check=True, capture_output=True)

    made = []
    try:
        try:
            for space in (name, *spaces.values()):
                ip("netns", "add", space)
                made.append(space)
            ip("-n", name, "link", "add", "bridge", "type", "bridge")
            ip("-n", name, "link", "set", "bridge", "up")
            for n, (address, space) in enumerate(spaces.items()):
                ip("-n", name, "link", "add", f"port{n}", "type", "veth", "peer", "name", "eth0", "netns", space)
                ip("-n", name, "link", "set", f"port{n}", "master", "bridge", "up")
                ip("-n", space, "address", "add", f"{address}/24", "dev", "eth0")
                for device in ("lo", "eth0"):
                    ip("-n", space, "link", "set", device, "up")
        except (OSError, subprocess.CalledProcessError) as error:
            pytest.skip(f"no network namespaces here: {error}")
        yield lambda address, command: ["ip", "netns", "exec", spaces[address], "sh", "-c", f"exec {command}"]
    finally:
        for space in made:
            subprocess.run(["ip", "netns", "delete", space], check=False)


@contextmanager
def loopback_addresses(addresses: list[str]) -> Iterator[Shell]:
    """A loopback address in place of each."""
    yield lambda address, command: ["sh", "-c", f"exec {command.replace(NETWORK, '127.77.0.')}"]


@pytest.mark.slow
@pytest.mark.parametrize("computers", [namespaces, loopback_addresses])
def test_the_page_s_commands_run(tmp_path, monkeypatch, computers):
    monkeypatch.chdir(tmp_path)
    Path("arms.toml").write_text(STUDY)
    paths = str(Path(sys.executable).parent), os.environ["PATH"]
    environment = {**os.environ, "PATH": os.pathsep.join(paths), "PYTHONPATH": os.pathsep.join(sys.path)}
    running: list[subprocess.Popen[str]] = []
    assert [command.split()[:2] for _, command in COMMANDS] == [
        ["dask", "scheduler"],
        ["dask", "worker"],
        ["dask", "worker"],
        ["zwidth", "sweep"],
    ]
    with computers([f"{NETWORK}{n}" for n in (1, 2, 3)]) as shell:
        try:
            for (address, command), said in zip(
                COMMANDS, [FACES_ITS_SCHEDULER, REGISTERED, REGISTERED], strict=False
            ):
                words = shell(address, command)
                program = subprocess.Popen(
                    words, env=environment, stderr=subprocess.PIPE, text=True, start_new_session=True
                )
                running.append(program)
                wait_for(program, said)
            address, command = COMMANDS[-1]
            ran = subprocess.run(shell(address, command), env=environment, capture_output=True, text=True)
        finally:
            for program in running:
                with suppress(ProcessLookupError):
                    os.killpg(program.pid, 9)
                program.communicate()
    assert ran.returncode == 0, ran.stderr
    assert "2000 designs over links.upper-right.length_m, loop.sampling_period_s" in ran.stdout
    assert run_command("sweep", "arms.toml", "--output", "here.csv").code == 0
    assert Path("arms.csv").read_bytes() == Path("here.csv").read_bytes()


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")
def test_the_page_s_python_runs():
    (program,) = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    names: dict[str, object] = {}
    exec(compile(program, "cluster.md", "exec"), names)
    assert dict(names["results"].sizes) == {"loop.sampling_period_s": 3}  # type: ignore[attr-defined]
