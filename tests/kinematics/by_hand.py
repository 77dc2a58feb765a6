"""Kinematics of two robots from nothing but the standard library: elementary products and the law of cosines.

It shares no code, no convention and no library with respot: the arm is drawn stretched out horizontally (KUKA) or with
its upper arm upright (ABB), as the makers draw it.
"""

import math
from dataclasses import dataclass


def product(*factors):
    result = factors[0]
    for b in factors[1:]:
        result = [[sum(result[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]
    return result


def along(x=0.0, y=0.0, z=0.0):
    return [[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]]


def turn(axis, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return {
        "x": [[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]],
        "y": [[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]],
        "z": [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
    }[axis]


def wrap(angle):
    return angle - 360.0 * math.ceil((angle - 180.0) / 360.0)


@dataclass
class Arm:
    """Lengths as the makers draw them: ``fore``, ``up`` lead from axis 3 to the wrist, the forearm being horizontal."""

    kuka: bool
    a1: float
    height: float
    upper: float
    fore: float
    up: float
    flange: float

    def forward(self, q):
        s = -1.0 if self.kuka else 1.0
        upper = along(x=self.upper) if self.kuka else along(z=self.upper)
        arm = product(
            along(z=self.height), turn("z", s * q[0]), along(x=self.a1), turn("y", q[1]), upper, turn("y", q[2])
        )
        hand = product(along(x=self.fore, z=self.up), turn("x", s * q[3]), turn("y", q[4]), turn("x", s * q[5]))
        return product(arm, hand, along(x=self.flange), turn("y", 90))

    def inverse(self, pose):
        """All solutions as (joints, behind axis 1, above the stretched arm)."""
        wrist = [pose[i][3] - self.flange * pose[i][2] for i in range(3)]
        forearm = math.hypot(self.fore, self.up)
        found = []
        for behind in (False, True):
            heading = math.degrees(math.atan2(wrist[1], wrist[0])) + (180.0 if behind else 0.0)
            x = math.cos(math.radians(heading)) * wrist[0] + math.sin(math.radians(heading)) * wrist[1] - self.a1
            z = wrist[2] - self.height
            cosine = (x * x + z * z - self.upper**2 - forearm**2) / (2 * self.upper * forearm)
            if abs(cosine) > 1:
                continue
            for above in (True, False):
                bend = math.acos(cosine) * (1 if above else -1)
                lower = -math.atan2(z, x) - math.atan2(forearm * math.sin(bend), self.upper + forearm * math.cos(bend))
                slope = math.degrees(lower + bend + math.atan2(self.up, self.fore))
                second = math.degrees(lower) + (0.0 if self.kuka else 90.0)
                found += [(joints, behind, above) for joints in self._hand(pose, heading, second, slope)]
        return found

    def _hand(self, pose, heading, second, slope):
        arm = product(turn("z", heading), turn("y", slope))
        back = [[arm[j][i] for j in range(3)] + [0] for i in range(3)] + [[0, 0, 0, 1]]
        r = product(back, pose, turn("y", -90))
        s = -1.0 if self.kuka else 1.0
        for flip in (1, -1):
            fifth = flip * math.acos(max(-1.0, min(1.0, r[0][0])))
            sine = math.sin(fifth)
            fourth = math.degrees(math.atan2(r[1][0] / sine, -r[2][0] / sine))
            sixth = math.degrees(math.atan2(r[0][1] / sine, r[0][2] / sine))
            angles = (s * heading, second, slope - second, s * fourth, math.degrees(fifth), s * sixth)
            yield [wrap(angle) for angle in angles]


# KR 210 R2700 prime: krl.md section 7. IRB 6700-200/2.60: calibration.md section 9.
KUKA = Arm(True, 350, 675, 1150, 1200, -41, 240)
ABB = Arm(False, 320, 780, 1125, 1142.5, 200, 200)
