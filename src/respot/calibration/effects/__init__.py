"""The catalogue of effects: one file each, one line each in `EFFECTS`."""

from __future__ import annotations

from types import ModuleType

from respot.calibration.effects import swapped_ids, tool_offset

EFFECTS: dict[str, ModuleType] = {swapped_ids.NAME: swapped_ids, tool_offset.NAME: tool_offset}
