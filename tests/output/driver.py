"""A warmed process that runs respot in children of its own, and kills them where a test says.

Reads one JSON request a line from stdin and answers with one. A child starts with everything imported, so that sixty
kills cost little. What may kill it, or stand in its way, is put around names of the system's own functions here; respot
knows nothing of it.
"""

from __future__ import annotations

import ctypes
import functools
import json
import os
import resource
import select
import signal
import sys
import tempfile
import time
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import shutil  # isort: skip

import respot.output.disk
import respot.output.in_place
import respot.output.new_folder
import respot.output.undo
import respot.output.workplace
from respot.cli import app

#: What changes a disk, by the names under which respot calls it.
STEPS = (
    (os, "mkdir"),
    (os, "link"),
    (os, "fsync"),
    (os, "rename"),
    (os, "unlink"),
    (os, "rmdir"),
    (os, "utime"),
    (Path, "write_bytes"),
    (shutil, "copymode"),
    (respot.output.disk, "sync_disk"),
    (respot.output.workplace, "exchange"),
    (respot.output.new_folder, "prove"),
    (respot.output.in_place, "prove"),
)
_NEW_NAMES, _NEW_USER = 0x20000, 0x10000000
_PRIVATE, _READ_ONLY, _REMOUNT = 0x44000, 0x1, 0x20


class Steps:
    """Counts the steps of a child, tells the driver of the first, and kills at one of them."""

    def __init__(self, kill: dict | None, begun: int) -> None:
        self.names: list[str] = []
        self._kill = kill or {}
        self._begun = begun

    def wrap(self, owner: object, name: str) -> None:
        inner = getattr(owner, name)

        @functools.wraps(inner)
        def outer(*args, **kwargs):
            if not self.names:
                os.write(self._begun, b"!")
            self.names.append(name)
            number = len(self.names)
            if self._kill.get("step") == number and self._kill["moment"] == "before":
                os.kill(os.getpid(), signal.SIGKILL)
            try:
                return inner(*args, **kwargs)
            finally:
                if self._kill.get("step") == number:
                    os.kill(os.getpid(), signal.SIGKILL)

        setattr(owner, name, outer)


def main() -> None:
    for line in sys.stdin:
        print(json.dumps(_serve(json.loads(line))), flush=True)


def _serve(request: dict) -> dict:
    if request.get("warm"):
        with Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
            return {"code": _run(request["arguments"])}
    read, write = os.pipe()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        started = time.monotonic()
        child = os.fork()
        if child == 0:
            os.close(read)
            _child(request, write, place)
        os.close(write)
        begun, killed = _watch(child, read, (request.get("kill") or {}).get("after"))
        _, status = os.waitpid(child, 0)
        seconds = time.monotonic() - started
        os.close(read)
        said = json.loads((place / "said").read_text()) if (place / "said").exists() else {}
        texts = {name: (place / name).read_text() if (place / name).exists() else "" for name in ("out", "err")}
    ended = -os.WTERMSIG(status) if os.WIFSIGNALED(status) else os.WEXITSTATUS(status)
    return {"code": ended, "seconds": seconds, "begun": begun, "killed": killed, **texts, **said}


def _watch(child: int, read: int, after: dict | None) -> tuple[float | None, bool]:
    """Seconds after which the first step came, and whether the child was killed: at a time from its start or that step."""
    started = time.monotonic()
    begun = None
    until = started + after["seconds"] if after and after["since"] == "start" else None
    while True:
        wait = None if until is None else max(0.0, until - time.monotonic())
        ready, _, _ = select.select([read] if begun is None else [], [], [], wait)
        if ready:
            if not os.read(read, 1):  # it ended without a step
                return None, False
            begun = time.monotonic() - started
            if after and after["since"] == "begin":
                until = time.monotonic() + after["seconds"]
            if until is None:
                return begun, False
        else:
            os.kill(child, signal.SIGKILL)
            return begun, True


def _child(request: dict, begun: int, place: Path) -> None:
    code = 70
    try:
        for number, name in ((1, "out"), (2, "err")):
            os.dup2(os.open(place / name, os.O_WRONLY | os.O_CREAT, 0o600), number)
        os.chdir(request.get("folder", "/"))
        said: dict = {}
        _prepare(request, said)
        steps = Steps(request.get("kill"), begun)
        for owner, name in STEPS:
            steps.wrap(owner, name)
        code = _run(request["arguments"])
        sys.stdout.flush()
        said.update(steps=steps.names)
        if request.get("list"):
            said["left"] = sorted(str(path.relative_to(request["list"])) for path in Path(request["list"]).rglob("*"))
        # whoever is killed here has said all or nothing
        (place / "saying").write_text(json.dumps(said))
        (place / "saying").replace(place / "said")
    finally:
        os._exit(code)


def _run(arguments: list[str]) -> int:
    sys.argv = ["respot", *arguments]
    try:
        app(prog_name="respot")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1
    return 0


def _prepare(request: dict, said: dict) -> None:
    if request.get("no_exchange"):  # as on a system without it
        respot.output.workplace.exchange = lambda first, second: False
    if request.get("no_links"):  # as on a disk without them

        def refuse(*args, **kwargs):
            raise PermissionError(1, "Operation not permitted")

        os.link = refuse
    if request.get("no_sync_disk"):  # as on a system that waits for files one by one
        respot.output.disk.sync_disk = lambda folder: False
    for mount in request.get("mounts", ()):
        said["mounted"] = _may_mount(mount) and _mount(mount)
    if request.get("largest_file"):
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (request["largest_file"],) * 2)
    if request.get("drop_rights"):
        _drop_rights()


def _may_mount(mount: dict) -> bool:
    """Try it in a child: half of a try cannot be taken back."""
    probe = os.fork()
    if probe == 0:
        try:
            os._exit(0 if _mount(mount) else 1)
        except OSError:
            os._exit(1)
    return os.waitpid(probe, 0)[1] == 0


def _mount(mount: dict) -> bool:
    """Mount a small disk, for this child alone; False where the system does not let us."""
    libc = ctypes.CDLL(None, use_errno=True)
    uid, gid = os.getuid(), os.getgid()
    if libc.unshare(_NEW_NAMES) != 0:
        if libc.unshare(_NEW_NAMES | _NEW_USER) != 0:
            return False
        Path("/proc/self/setgroups").write_text("deny")
        Path("/proc/self/uid_map").write_text(f"0 {uid} 1")
        Path("/proc/self/gid_map").write_text(f"0 {gid} 1")
    if libc.mount(None, b"/", None, _PRIVATE, None) != 0:
        return False
    path = os.fsencode(mount["path"])
    if libc.mount(b"tmpfs", path, b"tmpfs", 0, f"size={mount['size']}".encode()) != 0:
        return False
    return not mount.get("read_only") or libc.mount(None, path, None, _REMOUNT | _READ_ONLY, None) == 0


def _drop_rights() -> None:
    """Root reads and writes everything: let a child of root be asked for permission like anybody else."""

    class Header(ctypes.Structure):
        _fields_ = (("version", ctypes.c_uint32), ("pid", ctypes.c_int))

    class Data(ctypes.Structure):
        _fields_ = (("effective", ctypes.c_uint32), ("permitted", ctypes.c_uint32), ("inheritable", ctypes.c_uint32))

    assert ctypes.CDLL(None).capset(ctypes.byref(Header(0x20080522, 0)), (Data * 2)()) == 0


if __name__ == "__main__":
    main()
