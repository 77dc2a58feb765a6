"""How fast poses, Jacobians and inverses are, against py-opw-kinematics called directly and each other, in one run.

Usage: ``python tests/bench/bench_kinematics.py [--poses 10000] [--repeat 5] [--robot kr210_r2700_prime]``

Every time is the best of the repetitions, taken in turn so that a slow moment hits both sides; each line is a ratio of
two of them with the bound it should keep. The numerical inverse solves the same robot written in Denavit-Hartenberg
parameters, from zero joints, and is compared with the closed form; all branches of it, which takes forty starts a pose,
are timed on a hundredth of the poses.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping

import numpy as np
from py_opw_kinematics import KinematicModel, Robot
from scipy.spatial.transform import RigidTransform

from respot.geometry import Array
from respot.kinematics.dh import DhRobot, Link
from respot.kinematics.opw import LENGTHS, OpwRobot
from respot.kinematics.robots import find_robot

#: Reach and turn of a solution that counts as reached.
REACHED_MM, REACHED_DEG = 1e-5, 1e-6
UR10 = DhRobot(
    name="ur10",
    links=(Link(0, 90, 127.3), Link(-612), Link(-572.3), Link(0, 90, 163.941), Link(0, -90, 115.7), Link(0, 0, 92.2)),
)


def best(calls: Mapping[str, Callable[[], object]], repeat: int) -> dict[str, float]:
    """Shortest time of each call [s]."""
    times = dict.fromkeys(calls, np.inf)
    for call in calls.values():
        call()  # what is computed once is not counted
    for _ in range(repeat):
        for name, call in calls.items():
            start = time.perf_counter()
            call()
            times[name] = min(times[name], time.perf_counter() - start)
    return times


def direct(robot: OpwRobot) -> Robot:
    """Return the same robot of py-opw-kinematics."""
    lengths = {name: getattr(robot, name) for name in LENGTHS}
    flips = [sign < 0 for sign in robot.signs]
    model = KinematicModel(**lengths, offsets=tuple(robot.offsets_deg), flip_axes=tuple(flips))
    return Robot(model)


def as_dh(robot: OpwRobot) -> DhRobot:
    """Return the same arm in standard Denavit-Hartenberg parameters; joints are those of the chain, `to_dh`."""
    links = (
        Link(robot.a1, -90, robot.c1), Link(robot.c2, 0, 0, -90), Link(robot.a2, 90, 0, 90), Link(0, -90, robot.c3),
        Link(0, 90), Link(0, 0, robot.c4),
    )  # fmt: skip
    return DhRobot(name=f"{robot.name} in DH", links=links)


def to_dh(robot: OpwRobot, joints: Array) -> Array:
    """Joints of `as_dh`: the angles of the chain, all zero when the arm points straight up."""
    return np.asarray(joints * robot.signs - np.array(robot.offsets_deg))


def reached(robot: DhRobot, poses: RigidTransform, solutions: Array) -> Array:
    """Whether each pose has a solution that reaches it."""
    exists = np.isfinite(solutions).all(axis=1)
    again = robot.forward(np.where(exists[:, None], solutions, 0.0))
    error_mm = np.linalg.norm(again.translation - poses.translation, axis=1)
    error_deg = np.degrees((again.rotation * poses.rotation.inv()).magnitude())
    return np.asarray(exists & (error_mm < REACHED_MM) & (error_deg < REACHED_DEG))


def main() -> None:
    """Print the ratios."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--poses", type=int, default=10_000)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--robot", default="kr210_r2700_prime")
    arguments = parser.parse_args()
    robot = find_robot(arguments.robot)
    peer, dh = direct(robot), as_dh(robot)
    joints = np.random.default_rng(0).uniform(-175.0, 175.0, (arguments.poses, 6))
    poses, few = robot.forward(joints), slice(max(1, arguments.poses // 100))
    assert np.abs(peer.batch_forward(joints).as_matrix() - poses.as_matrix()).max() < 1e-6
    assert np.abs(dh.forward(to_dh(robot, joints)).as_matrix() - poses.as_matrix()).max() < 1e-6
    times = best(
        {
            "forward": lambda: robot.forward(joints),
            "jacobian": lambda: robot.jacobian(joints),
            "peer forward": lambda: peer.batch_forward(joints),
            "inverse": lambda: robot.inverse(poses),
            "peer inverse": lambda: peer.reach(poses),
        },
        arguments.repeat,
    )
    start = np.zeros(6)
    slow = best({"numerical": lambda: dh.inverse(poses, near=start)}, 1)["numerical"]
    every = best({"branches": lambda: dh.inverse(poses[few])}, 1)["branches"] * len(poses) / len(poses[few])
    print(f"{robot.name}, {len(poses)} poses; times in ms, best of {arguments.repeat}")
    for name, seconds in {**times, "numerical": slow, "all branches": every}.items():
        print(f"  {name:14} {1e3 * seconds:10.1f}")
    print(f"{'':44} {'ratio':>8} {'bound':>8}")
    show("geometric Jacobian / forward", times["jacobian"] / times["forward"], 2.0)
    show("forward / py-opw-kinematics", times["forward"] / times["peer forward"], 1.3)
    show("inverse, eight branches / py-opw-kinematics", times["inverse"] / times["peer inverse"], 1.3)
    show("numerical inverse, one / closed form, eight", slow / times["inverse"])
    show("numerical inverse, all / closed form, eight", every / times["inverse"])
    print(f"{'numerical inverse: share of poses reached':44} {'share':>8} {'bound':>8}")
    for arm in (dh, UR10):
        goal = poses if arm is dh else arm.forward(joints)
        share = reached(arm, goal, arm.inverse(goal, near=start)[:, 0]).mean()
        print(f"  {arm.name:42} {share:8.2%} {'>= 99.9%':>8}")


def show(what: str, ratio: float, bound: float | None = None) -> None:
    """Print a ratio and what it should keep."""
    print(f"  {what:42} {ratio:8.2f} {'' if bound is None else f'<= {bound:g}':>8}")


if __name__ == "__main__":
    main()
