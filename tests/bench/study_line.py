"""A line of full size: what is found of what is hidden, and whether killed runs come to the same bytes.

python tests/bench/study_line.py found                 effects found against the truth, robot by robot
python tests/bench/study_line.py killed --kills 30     the main process killed with SIGKILL, a third at named write steps
python tests/bench/study_line.py workers --kills 10    workers killed, then --retry until all is done

Each makes its own line of ``--robots`` with real fits (``--effects auto`` for measured ones) and runs ``respot migrate``.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from respot.simulation import plant_files  # noqa: E402
from tests.line.driver import STEPS  # noqa: E402
from tests.line.lines import contents  # noqa: E402
from tests.line.test_killed import workers_of  # noqa: E402

_ARMED = "from tests.line.driver import armed; armed({step!r}, {times}); from respot.cli import main; main()"
#: Steps of the workers: in a pool they are not in the main process.
_ELSEWHERE = ("a backup is written, its page not",)
#: Steps that come once all robots are done.
_LATE = list(STEPS)[-3:]


def make(folder: Path, robots: int, spots: int, seed: int) -> Path:
    """Write the line."""
    for path, data in plant_files(robots, spots, 0.1, seed):
        place = folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(data)
    return folder / "line.toml"


def start(line: Path, out: Path, *more: str, step: str = "", times: int = 1) -> subprocess.Popen[str]:
    """Start a run; its events come on stderr."""
    front = ["-c", _ARMED.format(step=step, times=times)] if step else ["-m", "respot"]
    command = [sys.executable, *front, "migrate", str(line), "-o", str(out), "-j", "2", "--json", *more]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def whole(line: Path, out: Path, *more: str) -> float:
    """Run to the end; wall time [s]."""
    started = time.monotonic()
    with start(line, out, *more) as run:
        _, errors = run.communicate()
    if run.returncode not in (0, 1):
        raise SystemExit(errors)
    return time.monotonic() - started


def killed(line: Path, folder: Path, kills: int, seed: int) -> None:
    """Kill the main process over and over."""
    took = whole(line, folder / "undisturbed")
    print(f"undisturbed: {took:.0f} s", flush=True)
    chance = random.Random(seed)
    early = [step for step in STEPS if step not in _LATE and step not in _ELSEWHERE]
    plan: list[dict[str, Any]] = [
        {"step": early[n % len(early)], "times": chance.randint(1, 2)} for n in range(kills // 3 - len(_LATE))
    ]
    for kill in plan:
        if kill["step"] == early[0]:
            kill["times"] = 1
    plan += [{"after": chance.choice([0, 1, 1, 2]), "delay": chance.uniform(0, 8)} for _ in range(kills - kills // 3)]
    chance.shuffle(plan)
    plan += [{"step": step, "times": 2 if "second" in step else 1} for step in _LATE]
    out, died = folder / "out", Counter[str]()
    for kill in plan:
        with start(line, out, step=kill.get("step", ""), times=kill.get("times", 1)) as run:
            assert run.stderr is not None
            if "after" in kill:
                for _ in range(kill["after"]):
                    run.stderr.readline()
                time.sleep(kill["delay"])
                run.kill()
            run.communicate()
        died[kill.get("step", "any time")] += run.returncode == -signal.SIGKILL
    whole(line, out)
    for step, count in died.items():
        print(f"  {count} at: {step}")
    same = contents(out) == contents(folder / "undisturbed")
    print(f"main process killed {died.total()} times: {len(contents(out))} files, {'equal' if same else 'DIFFERENT'}")


def workers(line: Path, folder: Path, kills: int, seed: int) -> None:
    """Kill workers in the middle of their work, then try again what was lost."""
    whole(line, folder / "undisturbed")
    chance, out, count, runs = random.Random(seed), folder / "out", 0, 0
    while count < kills or runs == 0:
        with start(line, out, "--retry") as run:
            runs += 1
            assert run.stderr is not None
            for _ in run.stderr:
                time.sleep(chance.uniform(0, 3))
                below = workers_of(run.pid)
                if below and count < kills and chance.random() < 0.5:
                    os.kill(chance.choice(below), signal.SIGKILL)
                    count += 1
        if runs > kills:
            break
    whole(line, out, "--retry")
    same = contents(out) == contents(folder / "undisturbed")
    print(f"workers killed {count} times in {runs} runs: {'equal' if same else 'DIFFERENT'}")


def found(line: Path, folder: Path) -> None:
    """Compare what is found with the truth."""
    took = whole(line, folder / "out")
    record = json.loads((folder / "out" / "line.json").read_bytes())
    truth = json.loads((line.parent / "truth.json").read_bytes())
    counts = Counter[str]()
    for hidden, robot in zip(truth["robots"], record["robots"], strict=True):
        if hidden["trouble"]:
            counts[f"trouble, {'failed' if robot['state'] == 'failed' else 'NOT NOTICED'}"] += 1
            continue
        own = {key(each) for each in hidden["effects"]}
        seen = {key(each) for each in robot["effects"]}
        proved = {key(each) for each in robot["effects"] if each["named"]}
        for effect in own:
            counts["found" if effect in seen else "MISSED"] += 1
            counts["of these named"] += effect in proved
            if effect not in seen:
                print(f"  {robot['name']}: missed {effect}, found {seen or 'nothing'}")
        for effect in seen - own:
            counts["found beside"] += 1
            counts["named wrongly"] += effect in proved
            print(
                f"  {robot['name']}: {effect} found {'and NAMED ' if effect in proved else ''}beside {own or 'nothing'}"
            )
        counts["nothing hidden, nothing found"] += not own and not seen
    print(f"{len(record['robots'])} robots in {took:.0f} s: {dict(counts)}")
    recurring = truth["recurring"]
    for row in record["fleet"]:
        if row["effect"]["name"] == recurring["effect"]:
            print(f"recurring ({recurring}): on {row['count']} of {row['of']}, gathers on {row['goes_with']}")


def key(effect: dict[str, Any]) -> str:
    """Name and place of an effect, as far as truth and finding say the same."""
    where = effect["where"]
    told = {name: where[name] for name in ("axis", "column", "level", "parameter") if name in where}
    return f"{effect['name']} {told}" if effect["name"] in ("joint_zero", "group_shift") else str(effect["name"])


def main() -> None:
    """Run one part."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=["found", "killed", "workers"])
    parser.add_argument("--robots", type=int, default=60)
    parser.add_argument("--spots", type=int, default=40)
    parser.add_argument("--kills", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        line = make(folder / "line", told.robots, told.spots, told.seed)
        if told.part == "found":
            found(line, folder)
        else:
            {"killed": killed, "workers": workers}[told.part](line, folder, told.kills, told.seed)


if __name__ == "__main__":
    main()
