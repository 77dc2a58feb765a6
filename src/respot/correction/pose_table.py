"""Poses of many targets, kept as one batch: single ones would cost more than what is done with them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from scipy.spatial.transform import RigidTransform


class PoseTable(Mapping[int, RigidTransform]):
    """Poses by a key, such as the `id` of what lies there.

    Parameters
    ----------
    keys : sequence of n int
        Each once.
    poses : RigidTransform or None
        A batch of n; None for n = 0.
    """

    def __init__(self, keys: Sequence[int] = (), poses: RigidTransform | None = None) -> None:
        self._rows = {key: row for row, key in enumerate(keys)}
        self._poses = poses

    def of(self, keys: Sequence[int]) -> RigidTransform:
        """Return the poses of n > 0 keys as a batch."""
        assert self._poses is not None  # noqa: S101 - there is no key
        return self._poses[[self._rows[key] for key in keys]]

    def only(self, keys: Sequence[int]) -> PoseTable:
        """Return the table of some keys."""
        return PoseTable(keys, self.of(keys)) if keys else PoseTable()

    def __getitem__(self, key: int) -> RigidTransform:
        row = self._rows[key]
        assert self._poses is not None  # noqa: S101 - there is a key
        return self._poses[row]

    def __contains__(self, key: object) -> bool:
        return key in self._rows

    def __iter__(self) -> Iterator[int]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)
