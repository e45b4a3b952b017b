"""Who may use the workbench, and what it hands out."""

from __future__ import annotations

import http.client
import re
import subprocess
import sys

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.app.socket_client import SocketClient
from tests.cli.command_runner import refusal_lines
from zwidth.show import page_files
from zwidth.show.app.server import LARGEST_REPORT, MOST_REPORTS, TYPES, Settings


def get(port: int, path: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of a request that says no more than it is told."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    connection.request("GET", path, headers={"Host": f"127.0.0.1:{port}", **headers})
    answer = connection.getresponse()
    found = answer.status, {key.lower(): value for key, value in answer.getheaders()}, answer.read()
    connection.close()
    return found


def test_the_page_and_its_files_are_handed_out_with_a_policy(workbench) -> None:
    for name, content in {"": page_files()["index.html"], **page_files()}.items():
        status, headers, body = get(workbench, f"/{name}")
        assert (status, body) == (200, content), name
        assert headers["content-type"] == TYPES[name[name.rindex(".") :] if name else ".html"]
        policy = headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe-inline" not in policy
        assert "'unsafe-eval'" not in policy
        assert "http:" not in policy, "nothing is loaded from another address"


def test_no_page_file_names_another_address() -> None:
    for name, content in page_files().items():
        if name.endswith((".js", ".html", ".css")):
            found = re.findall(r"https?://[^\s\"'`)]+", content.decode())
            assert [one for one in found if "www.w3.org" not in one] == [], name


@pytest.mark.parametrize(
    "path",
    [
        "/../server.py",
        "/%2e%2e/server.py",
        "/..%2fserver.py",
        "/page/../../../../etc/passwd",
        "//etc/passwd",
        "/index.html%00.js",
        "/docs",
        "/openapi.json",
    ],
)
def test_no_path_leads_out_of_the_page(workbench, path) -> None:
    status, _, body = get(workbench, path)
    assert status == 404
    assert len(body) < 200


def test_another_host_name_is_refused(workbench) -> None:
    status, _, body = get(workbench, "/", Host="attacker.example")
    assert status == 403
    assert b"127.0.0.1" in body


def test_requests_of_other_pages_are_refused(workbench) -> None:
    assert get(workbench, "/start", **{"Sec-Fetch-Site": "cross-site"})[0] == 403
    assert get(workbench, "/start", **{"Sec-Fetch-Site": "same-origin"})[0] == 200


@pytest.mark.parametrize("origin", ["http://attacker.example", "null", "http://127.0.0.1:1", None])
def test_sockets_of_other_pages_are_refused(workbench, origin) -> None:
    address = f"ws://127.0.0.1:{workbench}/socket"
    with pytest.raises(InvalidStatus, match="403"), connect(address, origin=origin) as socket:
        socket.recv(timeout=5)


def test_a_thirteenth_page_is_refused_and_a_closed_one_makes_room(workbench) -> None:
    opened = [SocketClient(workbench) for _ in range(12)]
    for one in opened:
        one.__enter__()
    with pytest.raises(InvalidStatus, match="403"), SocketClient(workbench):
        pass
    for one in opened:
        one.__exit__(None, None, None)
    for _ in range(100):
        try:
            with SocketClient(workbench) as again:
                assert again.ask("view", state={"device": "hapkit-course"})[0]["ok"]
            return
        except InvalidStatus:
            continue
    raise AssertionError("closed pages still count")


def test_a_token_is_asked_for_and_any_host_name_goes_with_it() -> None:
    open_to_all = Settings(host="0.0.0.0", token="secret")
    assert open_to_all.knows_host("lab-pc:8440")
    assert not open_to_all.admits(None)
    assert not open_to_all.admits("Secret")
    assert open_to_all.admits("secret")
    here = Settings()
    assert here.admits(None)
    assert not here.knows_host("lab-pc:8440")
    assert all(here.knows_host(host) for host in ("127.0.0.1:8440", "localhost:8440", "[::1]:8440"))


def test_another_address_needs_a_token_and_says_so() -> None:
    command = [sys.executable, "-m", "zwidth", "app", "--no-browser", "--port", "0", "--host", "0.0.0.0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        lines = [process.stderr.readline() for _ in range(3)]
        found = re.search(r"http://127\.0\.0\.1:(\d+)/\?token=(\S+)", lines[0])
        assert found, lines
        assert "not encrypted" in lines[1]
        assert "secure address" in lines[2]
        port, token = int(found[1]), found[2]
        assert get(port, "/")[0] == 403
        assert get(port, f"/?token={token}")[0] == 200
        with pytest.raises(InvalidStatus, match="403"), SocketClient(port):
            pass
        process.terminate()
        assert process.wait(20) in (0, -15)


def post(port: int, content: bytes, **headers: str) -> tuple[int, str]:
    """Status and answer of a report that is sent."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    connection.request("POST", "/reports", content, {"Host": f"127.0.0.1:{port}", **headers})
    answer = connection.getresponse()
    found = answer.status, answer.read().decode()
    connection.close()
    return found


def test_a_report_is_handed_out_so_that_nothing_in_it_runs(workbench) -> None:
    own = {"Origin": f"http://127.0.0.1:{workbench}"}
    for foreign in ({}, {"Origin": "http://attacker.example"}, {"Origin": "null"}):
        assert post(workbench, b"<p>", **foreign)[0] == 403
    assert post(workbench, b"<p>", **own, **{"Sec-Fetch-Site": "cross-site"})[0] == 403
    assert post(workbench, b"x" * (LARGEST_REPORT + 1), **own)[0] == 413
    names = [post(workbench, b"<p>%d" % n, **own) for n in range(MOST_REPORTS + 1)]
    assert {status for status, _ in names} == {200}
    assert get(workbench, f"/reports/{names[0][1]}")[0] == 404, "the oldest is no longer kept"
    status, headers, body = get(workbench, f"/reports/{names[-1][1]}")
    assert (status, body) == (200, b"<p>%d" % MOST_REPORTS)
    policy = headers["content-security-policy"]
    assert policy.endswith("; sandbox")
    assert "default-src 'none'" in policy
    assert "script" not in policy


def test_bad_command_lines_are_refused_on_one_line() -> None:
    for arguments, part in [
        (["no-such-device"], "is neither a file nor a bundled device"),
        (["five-bar", "--set", "loop.sampling_period_s=-1"], "must be at least"),
        (["--port", "70000"], "--port"),
    ]:
        assert any(part in line for line in refusal_lines("app", "--no-browser", *arguments)), arguments
    nowhere = ["--host", "no.such.host.invalid", "--port", "0"]
    command = [sys.executable, "-m", "zwidth", "app", "--no-browser", *nowhere]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert "cannot listen" in ended.stderr
    assert "Traceback" not in ended.stderr
