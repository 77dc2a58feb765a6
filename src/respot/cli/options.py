"""Arguments and options that commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Source = Annotated[
    Path, typer.Argument(help="Backup (folder or zip), program file, or spot table.", show_default=False)
]
Theory = Annotated[
    Path | None,
    typer.Option(
        "--theory", help="Where the spots should be: simulation or CAD, same coordinate system.", show_default=False
    ),
]
Measured = Annotated[
    Path | None,
    typer.Option(
        "--measured", help="Where the robot really went: tracker, CMM; any coordinate system.", show_default=False
    ),
]
FrameOption = Annotated[
    str | None,
    typer.Option(
        "--frame", help="same or free: whether both coordinate systems claim to be the same.", show_default=False
    ),
]
RobotName = Annotated[
    str | None, typer.Option("--robot-name", help="Which robot of a backup with several.", show_default=False)
]
RobotModel = Annotated[
    str | None,
    typer.Option(
        "--robot",
        help="Kinematics: a name that `respot robots` lists, or a TOML file. Without it the machine data decide.",
        show_default=False,
    ),
]
SpotId = Annotated[
    str | None,
    typer.Option("--spot-id", help="Regular expression for the spot ID in a target's name.", show_default=False),
]
Profiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--profile",
        help="TOML file with the instruction forms and spot names of a plant; may repeat.",
        show_default=False,
    ),
]
Noise = Annotated[
    float | None,
    typer.Option("--noise", min=0.0, help="Known noise of the reference per coordinate, mm.", show_default=False),
]
MethodOption = Annotated[
    str,
    typer.Option(
        "--method", help="robust, paper (the paper's own method) or affine (12 free parameters, for comparison only)."
    ),
]
Tau = Annotated[
    float | None,
    typer.Option(
        "--tau",
        help="Of --method paper: largest coordinate difference of an inlier, mm (default 10).",
        show_default=False,
    ),
]
NMin = Annotated[
    int | None,
    typer.Option(
        "--n-min",
        help="Of --method paper: a subset counts with more inliers than this outside of it (default half of them).",
        show_default=False,
    ),
]
Match = Annotated[
    str, typer.Option("--match", help="How spots are paired: auto, id (by name) or geometry (names play no part).")
]
EffectsOption = Annotated[
    str,
    typer.Option(
        "--effects",
        help="What to look for beside the rigid part: auto, none, or names of effects with commas, such as "
        "swapped_ids,joint_zero.",
    ),
]
Holdout = Annotated[
    str | None,
    typer.Option(
        "--holdout",
        metavar="FRACTION|TABLE",
        help="Keep a share of the spots (0.2 is a fifth), or those of a spot table, out of everything, and say how "
        "well the fit of the others predicts them.",
        show_default=False,
    ),
]
WeightsOption = Annotated[
    str,
    typer.Option(
        "--weights",
        help="Of a rigid fit: even, or direction (a residual counts by the noise of its direction, for noise that is "
        "not the same along all axes).",
    ),
]
OrientationsOption = Annotated[
    str,
    typer.Option(
        "--orientations",
        help="Tool orientations of both lists: compare (after the fit), or fit (with the positions, for a rigid fit).",
    ),
]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Seed of everything that is drawn.")]
Tolerance = Annotated[float, typer.Option("--tolerance", min=0.0, help="Tolerance of a spot, mm.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Strict = Annotated[bool, typer.Option("--strict", help="Exit 1 if there is an issue of level error.")]
Force = Annotated[bool, typer.Option("--force", help="Replace an output folder that is not empty.")]
