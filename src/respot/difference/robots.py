"""Two states of one robot: every difference in its files is a finding or noise, none is left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import starmap

from respot.difference.blocks import moved_blocks
from respot.difference.dialects import DIALECTS
from respot.difference.findings import FileChange, Noise, RobotDifference
from respot.difference.index import Index
from respot.difference.positions import Tolerance
from respot.difference.programs import FilePair, Side
from respot.difference.renames import Renames
from respot.difference.statements import StatementComparison, named
from respot.difference.texts import TextComparison, is_own_record, kind_of
from respot.program.robot import Robot


@dataclass(frozen=True, eq=False)
class RobotFiles:
    """A robot and the files that are compared as its own, by path in the backup."""

    robot: Robot
    files: Mapping[str, bytes]


class RobotComparison:
    """Compares two states of one robot.

    Parameters
    ----------
    old, new : RobotFiles
        Both states.
    paths : sequence of (str, str)
        Which file is which.
    removed, added : sequence of str
        Files that only one side has.
    tolerance : Tolerance
        What counts as the same place.
    """

    def __init__(
        self,
        old: RobotFiles,
        new: RobotFiles,
        paths: Sequence[tuple[str, str]],
        removed: Sequence[str],
        added: Sequence[str],
        tolerance: Tolerance,
    ) -> None:
        self._old, self._new = old, new
        self._dialect = DIALECTS[new.robot.language]
        self._old_index, self._new_index = Index(old.robot), Index(new.robot)
        self._paths, self._removed, self._added = paths, removed, added
        self.found = RobotDifference(new.robot.name, new.robot.language)
        self._statements = StatementComparison(self._old_index, self._new_index, tolerance, self.found)

    def run(self) -> RobotDifference:
        """Compare everything."""
        pairs: list[FilePair] = []
        for old_path, new_path in self._paths:
            self._note_move(old_path, new_path)
            before, after = self._old.files[old_path], self._new.files[new_path]
            old_file, new_file = self._old.robot.files.get(old_path), self._new.robot.files.get(new_path)
            if old_file is not None and new_file is not None:
                if before == after:
                    self._same_file(old_path, new_path)
                else:
                    sides = (
                        Side.read(old_file, self._old_index, self._dialect),
                        Side.read(new_file, self._new_index, self._dialect),
                    )
                    pairs.append(FilePair(*sides))
            elif before != after:
                self._other_file(old_path, new_path, before, after)
        self._programs(pairs)
        self._lone_files()
        return self.found

    # files

    def _note_move(self, old_path: str, new_path: str) -> None:
        old, new = self._below(old_path, new_path)
        if old != new and "/" in old + new and not self._all_moved:
            sizes = len(self._old.files[old_path]), len(self._new.files[new_path])
            kind = self._kind(new_path, self._new)
            self.found.files.append(FileChange(new_path, "moved", kind, *sizes, old_path))

    def _below(self, old_path: str, new_path: str) -> tuple[str, str]:
        return old_path[len(self._old.robot.root) :].lower(), new_path[len(self._new.robot.root) :].lower()

    @cached_property
    def _all_moved(self) -> bool:
        """Whether all files lie under one folder more or less, as where one side is ``KRC`` and the other holds it."""
        longer = {max(pair, key=len).removesuffix(min(pair, key=len)) for pair in starmap(self._below, self._paths)}
        sides = {len(old) > len(new) for old, new in starmap(self._below, self._paths)}
        return len(longer) == 1 == len(sides) and longer.pop().endswith("/")

    @staticmethod
    def _kind(path: str, side: RobotFiles) -> str:
        return "program" if path in side.robot.files else kind_of(path, side.files[path])

    def _same_file(self, old_path: str, new_path: str) -> None:
        before = {target.span: target for target in self._old_index.targets_of(old_path)}
        for target in self._new_index.targets_of(new_path):
            partner = before.get(target.span)
            if partner is not None:
                self._statements.target(partner, target, same_text=True)

    def _other_file(self, old_path: str, new_path: str, before: bytes, after: bytes) -> None:
        if is_own_record(new_path, after):
            self.found.noise.append(Noise("respot", new_path))
            return
        kind = kind_of(new_path, before, after)
        if kind != "binary":
            lines = TextComparison(old_path, new_path, before, after)
            self.found.code += lines.changes
            self.found.noise += lines.noise
            if not lines.changes:
                return
        self.found.files.append(FileChange(new_path, "changed", kind, len(before), len(after)))

    def _lone_files(self) -> None:
        for side, paths, change in ((self._old, self._removed, "removed"), (self._new, self._added, "added")):
            for path in paths:
                data = side.files[path]
                if is_own_record(path, data):
                    self.found.noise.append(Noise("respot", path))
                    continue
                sizes = (len(data), None) if change == "removed" else (None, len(data))
                self.found.files.append(FileChange(path, change, self._kind(path, side), *sizes))
                self._lone_program(path, side, removed=change == "removed")

    def _lone_program(self, path: str, side: RobotFiles, removed: bool) -> None:
        """Name the targets of a program that only one side has; its statements stand in the file itself."""
        file = side.robot.files.get(path)
        if file is None:
            return
        index = self._old_index if removed else self._new_index
        for target in index.targets_of(path):
            if target.declared:
                (self.found.removed if removed else self.found.added).append(named(target, index))

    # programs

    def _programs(self, pairs: Sequence[FilePair]) -> None:
        for pair in pairs:
            pair.pair_names()
        renames = Renames(pairs, self._old.robot, self._new.robot)
        self.found.renamed += renames.found
        for pair in pairs:
            names = renames.names_for(pair)
            pair.old.rename(names)
            if names:
                pair.pair_names()
            pair.align_code()
        blocks = moved_blocks(pairs)
        for pair in pairs:
            pair.pair_edited()
        for pair in pairs:
            self._statements.file(pair, [block for block in blocks if block.new_file is pair])
