"""Robots a line can be simulated with: nominal lengths, senses and limits of the arm.

The numbers are the makers' own, under the names that ``respot robots`` prints.
"""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches

LENGTHS = ("a1", "a2", "b", "c1", "c2", "c3", "c4")


@dataclass(frozen=True)
class RobotSpec:
    """Nominal arm with a spherical wrist.

    Parameters
    ----------
    name : str
        Built-in name.
    maker : str
        ``kuka`` or ``abb``.
    lengths : tuple of float
        a1, a2, b, c1, c2, c3, c4 [mm] of an ortho-parallel arm with a spherical wrist.
    offsets : tuple of float
        Angle of the arm = sign * joint - offset [deg].
    signs : tuple of int
        Sense of each axis.
    limits : tuple of (float, float)
        Software limits [deg].
    trafo : str
        Model as the controller spells it.
    ratios : tuple of (int, int)
        Turns of the motor for a turn of each axis, numerator and denominator; empty where no file tells.
    """

    name: str
    maker: str
    lengths: tuple[float, ...]
    offsets: tuple[float, ...]
    signs: tuple[int, ...]
    limits: tuple[tuple[float, float], ...]
    trafo: str
    ratios: tuple[tuple[int, int], ...] = ()

    def length(self, name: str) -> float:
        """Return a length of the arm by its name [mm]."""
        return self.lengths[LENGTHS.index(name)]


_KUKA_LIMITS = ((-185.0, 185.0), (-140.0, -5.0), (-120.0, 155.0), (-350.0, 350.0), (-125.0, 125.0), (-350.0, 350.0))
# of the order of what such arms have; no maker's numbers
_KUKA_RATIOS = ((-1757, 7), (-1881, 8), (-1710, 7), (-1339, 6), (-1207, 5), (-778, 5))
_ABB_LIMITS = ((-170.0, 170.0), (-65.0, 85.0), (-180.0, 70.0), (-300.0, 300.0), (-120.0, 120.0), (-300.0, 300.0))


def _kuka(name: str, lengths: tuple[float, ...], trafo: str) -> RobotSpec:
    return RobotSpec(
        name, "kuka", lengths, (0, -90, 0, 0, 0, 0), (-1, 1, 1, -1, 1, -1), _KUKA_LIMITS, trafo, _KUKA_RATIOS
    )


def _abb(name: str, lengths: tuple[float, ...], trafo: str) -> RobotSpec:
    return RobotSpec(name, "abb", lengths, (0, 0, -90, 0, 0, 0), (1, 1, 1, 1, 1, 1), _ABB_LIMITS, trafo)


ROBOTS: dict[str, RobotSpec] = {
    robot.name: robot
    for robot in (
        _kuka("kr210_r2700_extra", (350, 41, 0, 675, 1150, 1200, 215), "#KR210R2700 EXTRA C4 FLR"),
        _kuka("kr210_r2700_prime", (350, 41, 0, 675, 1150, 1200, 240), "#KR210R2700 PRIME C4 FLR"),
        _kuka("kr210_r2700_2", (330, -115, 0, 645, 1150, 1220, 215), "#KR210R2700_2 C4SR FLR"),
        _kuka("kr210_r3100_ultra", (350, 41, 0, 675, 1350, 1400, 240), "#KR210R3100 ULTRA C4 FLR"),
        _kuka("kr240_r2900_2", (330, -115, 0, 645, 1350, 1220, 240), "#KR240R2900_2 C4SR FLR"),
        _abb("irb6640_185_280", (320, -200, 0, 780, 1075, 1392, 200), "IRB 6640-185/2.8"),
        _abb("irb6700_200_260", (320, -200, 0, 780, 1125, 1142.5, 200), "IRB 6700-200/2.60"),
        _abb("irb6700_235_265", (320, -200, 0, 780, 1135, 1182.5, 200), "IRB 6700-235/2.65"),
    )
}


def spec_of(name: str) -> RobotSpec:
    """Robot of a name.

    Raises
    ------
    ValueError
        There is no such robot; the message suggests one.
    """
    if name in ROBOTS:
        return ROBOTS[name]
    close = get_close_matches(name.lower().replace("-", "_").replace(" ", "_"), ROBOTS, n=1, cutoff=0.4)
    hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(ROBOTS)}"
    raise ValueError(f"no robot {name} can be simulated: {hint}")
