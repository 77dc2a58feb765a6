"""A plan of measurements on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from respot.cli.display import Column, heading, line, table
from respot.cli.show_fit import describe

if TYPE_CHECKING:
    from respot.calibration.planning import Plan, PlannedSpot, SourcePlan

_MOST_PAIRS = 20


def show_plan(found: SourcePlan) -> None:
    """Print which spots to measure, what each buys, and how far explanations and intervals get."""
    plan = found.plan
    heading(f"{describe(found.source)}: {len(plan.spots)} of {plan.candidates} spots to measure next")
    if plan.spots:
        _spots(plan)
    if plan.pairs:
        _pairs(plan)
    if plan.spots:
        _surer(plan)
    if plan.noise_known is False:
        line(
            "The noise is known from the residuals alone: measure three of the spots three times (a column `repeat`), "
            "or give --noise to fit; no cause is named without it."
        )


def _spots(plan: Plan) -> None:
    columns = [Column("", number=True), Column("spot", number=False), *map(Column, ("x", "y", "z"))]
    columns += [Column("turned"), Column("buys", number=False)]
    rows = []
    for spot in plan.spots:
        turned = "-" if spot.turned_deg is None else f"{spot.turned_deg:.0f}"
        rows.append([str(spot.order), spot.id, *(f"{value:.1f}" for value in spot.position), turned, _buys(spot)])
    table(columns, rows)
    line("turned: degrees from the nearest tool orientation that was measured")


def _buys(spot: PlannedSpot) -> str:
    if spot.separates:
        names = "; ".join(" / ".join(names) for names in spot.separates[:2])
        more = f" and {len(spot.separates) - 2} more" if len(spot.separates) > 2 else ""
        return f"separates {names}{more}"
    if spot.buys:
        best, before, after = spot.buys[0]
        return f"{' / '.join(best)}: {before:.1f} -> {after:.1f} sigma"
    return "surer parameters"


def _pairs(plan: Plan) -> None:
    line("\nTo tell apart (standard deviations of the noise, whichever of the two is true):")
    columns = [Column("effect", number=False), Column("rival", number=False)]
    columns += [*map(Column, ("now", "then", "with all")), Column("", number=False)]
    rows = [
        [*pair.names, *(f"{value:.1f}" for value in (pair.before, pair.after, pair.with_all)), _verdict(plan, place)]
        for place, pair in enumerate(plan.pairs[:_MOST_PAIRS])
    ]
    table(columns, rows, marked=[not pair.promised for pair in plan.pairs[:_MOST_PAIRS]])
    if len(plan.pairs) > _MOST_PAIRS:
        line(f"... and {len(plan.pairs) - _MOST_PAIRS} more (--json lists all)")
    done = sum(pair.promised for pair in plan.pairs)
    line(f"{done} of {len(plan.pairs)} pairs will be separated clearly, nine times of ten")


def _verdict(plan: Plan, place: int) -> str:
    pair = plan.pairs[place]
    if pair.promised:
        return "separated"
    return "needs more spots" if pair.possible else "not by spots of this program"


def _surer(plan: Plan) -> None:
    if plan.parameters:
        line("\nHalf of the 95 % intervals, with the same noise:")
        columns = [Column("effect", number=False), Column("parameter", number=False)]
        columns += [Column("now"), Column("then"), Column("", number=False)]
        rows = [
            [each.effect, each.name, f"{each.before:.4g}", f"{each.after:.4g}", each.unit] for each in plan.parameters
        ]
        table(columns, rows)
    if plan.worst is not None:
        name, before, after = plan.worst
        line(
            f"\nThe worst 95 % ball of a predicted spot shrinks from {before:.2f} mm (at {name}) to {after:.2f} mm, if "
            "the model holds"
        )
