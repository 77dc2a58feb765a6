"""Effects that are judged before all others: names, conventions, the tool. The rest is in `catalogue`."""

from __future__ import annotations

from types import ModuleType

from respot.calibration.effects import convention, swapped_ids, tool_offset

EFFECTS: dict[str, ModuleType] = {each.NAME: each for each in (swapped_ids, convention, tool_offset)}
