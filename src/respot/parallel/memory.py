"""How much memory a process may have, where several share a machine."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

_CGROUP = Path("/sys/fs/cgroup/memory.max")
#: A process needs this much before it has read anything [MB].
_LEAST = 2048


def share_of_memory(processes: int) -> int | None:
    """Share of this machine's memory for each of some processes [MB]; None where the system does not say."""
    try:
        whole = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # not on every system
        return None
    with suppress(OSError, ValueError):  # no container, or one without a limit
        whole = min(whole, int(_CGROUP.read_text(encoding="ascii")))
    return max(_LEAST, whole // processes // 1024**2)
