"""Runs a line in processes forked from this one, which has imported all, and kills them at the moments it is told.

``python -m tests.line.driver`` reads one JSON object on standard input and prints one.
"""

from __future__ import annotations

import gc
import json
import os
import random
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

from respot.line import folder as folders
from respot.line import run as runs
from respot.line import work
from respot.line.ledger import Ledger
from respot.line.line_file import read_line

#: Named write steps: where the main process is killed, at the n-th time that it comes there.
STEPS: dict[str, tuple[object, str, str]] = {
    "the ledger has its plan": (Ledger, "plan", "after"),
    "before a robot is said to be running": (Ledger, "start", "before"),
    "a robot is said to be running": (Ledger, "start", "after"),
    "a backup is written, its page not": (work, "_write_fit", "before"),
    "a robot's folder is made and not in place": (folders.OutputFolder, "put", "before"),
    "a robot's folder is in place and the ledger does not know": (Ledger, "finish", "before"),
    "a robot is done": (Ledger, "finish", "after"),
    "all robots are done, no summary": (runs, "write_summary", "before"),
    "the second file of the summary is not there": (folders.OutputFolder, "write", "before"),
    "the summary is written": (folders.OutputFolder, "clear", "before"),
}


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def armed(step: str, times: int) -> None:
    """Kill this process when it comes to a step for the n-th time."""
    place, name, when = STEPS[step]
    real: Callable[..., object] = getattr(place, name)
    seen = 0

    def deadly(*arguments, **named):
        nonlocal seen
        seen += 1
        if when == "before" and seen == times:
            die()
        result = real(*arguments, **named)
        if when == "after" and seen == times:
            die()
        return result

    setattr(place, name, deadly)


def attempt(line: Path, out: Path, processes: int, kill: dict, retry: bool) -> bool:
    """Run once in a forked process; whether it was killed."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(reader)
            if "step" in kill:
                armed(kill["step"], kill["times"])
            watch = lambda event: os.write(writer, b".")  # noqa: E731
            runs.run_line(read_line(line), out, runs.Workers(processes), retry=retry, watch=watch)
        except BaseException as error:
            sys.stderr.write(f"{error!r}\n")
            os._exit(1)
        os._exit(0)
    os.close(writer)
    if "after" in kill:
        seen = 0
        while seen < kill["after"] and os.read(reader, 1):
            seen += 1
        time.sleep(kill["delay"])
        os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    os.close(reader)
    if os.WIFSIGNALED(status):
        return True
    if os.WEXITSTATUS(status):
        raise SystemExit("an attempt failed")
    return False


def moments(kills: int, pooled: int, delay: float, seed: int) -> list[dict]:
    """Draw when the main process dies: two thirds at any time after some robots, a third at named steps."""
    chance = random.Random(seed)
    steps = list(STEPS)
    late = 3  # steps that come once all robots are done
    named = [steps[number % (len(steps) - late)] for number in range(kills // 3 - late)]
    early = [{"step": step, "times": chance.randint(1, 2)} for step in named]
    early = [{**kill, "times": 1} if kill["step"] == steps[0] else kill for kill in early]
    timed = [
        {"after": chance.choice([0, 1, 1, 2]), "delay": chance.uniform(0.0, delay)} for _ in range(kills - kills // 3)
    ]
    for kill in chance.sample(timed, pooled):
        kill["processes"] = 2
    mixed = [*early, *timed]
    chance.shuffle(mixed)
    return [*mixed, *({"step": step, "times": 2 if "second" in step else 1} for step in steps[-late:])]


def main() -> None:
    told = json.load(sys.stdin)
    line, out = Path(told["line"]), Path(told["out"])
    gc.freeze()
    killed = 0
    for kill in moments(told["kills"], told["pooled"], told["delay"], told["seed"]):
        killed += attempt(line, out, kill.get("processes", 0), kill, retry=False)
    while attempt(line, out, 0, {}, retry=False):
        pass
    print(json.dumps({"killed": killed}))


if __name__ == "__main__":
    main()
