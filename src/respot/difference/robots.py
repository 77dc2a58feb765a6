"""Two states of one robot: every difference in its files is a finding or noise, none is left out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from respot.difference.alignment import increasing
from respot.difference.blocks import Block, moved_blocks
from respot.difference.canonical import key
from respot.difference.dialect import ranked
from respot.difference.dialects import DIALECTS
from respot.difference.drift import Writes, covered, differing
from respot.difference.findings import CodeChange, FileChange, Named, Noise, Place, RobotDifference, Shift
from respot.difference.frames import FrameComparer, frame_masks, frames_in
from respot.difference.index import Index
from respot.difference.noise import layout, remarks, spelled_otherwise
from respot.difference.parts import Part
from respot.difference.positions import Comparer, Tolerance, pair_targets
from respot.difference.programs import CodePair, DataPair, FilePair, Side
from respot.difference.renames import Renames
from respot.difference.texts import TextComparison, is_own_record, kind_of
from respot.issues import Issue
from respot.program.robot import Robot
from respot.program.statement import Statement
from respot.program.targets import Target
from respot.source import NEWLINE


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
        self._comparer = Comparer(self._old_index, self._new_index, tolerance)
        self._frames = FrameComparer(self._old_index, self._new_index, tolerance)
        self._writes = Writes(old.robot, self._dialect), Writes(new.robot, self._dialect)
        self._paths, self._removed, self._added = paths, removed, added
        self.found = RobotDifference(new.robot.name, new.robot.language)

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
        below = [
            path[len(side.robot.root) :].lower()
            for path, side in ((old_path, self._old), (new_path, self._new))
        ]  # fmt: skip
        if below[0] != below[1] and "/" in below[0] + below[1]:
            sizes = len(self._old.files[old_path]), len(self._new.files[new_path])
            kind = self._kind(new_path, self._new)
            self.found.files.append(FileChange(new_path, "moved", kind, *sizes, old_path))

    @staticmethod
    def _kind(path: str, side: RobotFiles) -> str:
        return "program" if path in side.robot.files else kind_of(path, side.files[path])

    def _same_file(self, old_path: str, new_path: str) -> None:
        before = {target.span: target for target in self._old_index.targets_of(old_path)}
        for target in self._new_index.targets_of(new_path):
            partner = before.get(target.span)
            if partner is not None:
                self._target(partner, target, same_text=True)

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
                (self.found.removed if removed else self.found.added).append(_named(target, index))

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
            self._file(pair, [block for block in blocks if block.new_file is pair])

    def _file(self, pair: FilePair, blocks: Sequence[Block]) -> None:
        before = self._counts()
        for old, new in pair.parts:
            for data in (data for data in pair.data if data.new is new and data.old is old):
                self._data(pair, data)
            for code in (code for code in pair.code if code.new is new and code.old is old):
                self._code(pair, code)
        for block in blocks:
            self._block(block)
        for part in pair.removed:
            self._lone_part(pair, part, removed=True)
        for part in pair.added:
            self._lone_part(pair, part, removed=False)
        self.found.noise += remarks(pair, pair.parts)
        self.found.noise += layout(pair.old.file.source, pair.new.file.source)
        common = [[name for name in side.parts if name in other.parts] for side, other in _both_ways(pair)]
        if common[0] != common[1]:
            self.found.noise.append(Noise("order", pair.new.path))
        if before == self._counts() and not pair.old.names:
            self.found.noise.append(Noise("blanks", pair.new.path))

    def _counts(self) -> tuple[int, ...]:
        found = self.found
        places = len(found.moved), len(found.added), len(found.removed), len(found.renamed)
        return (*places, len(found.frames), len(found.code), len(found.noise))

    def _block(self, block: Block) -> None:
        old = block.old.old.code[block.old_start : block.old_start + block.length]
        new = block.new.new.code[block.new_start : block.new_start + block.length]
        paths = block.old_file.old.path, block.new_file.new.path
        places = Place(paths[0], old[0].line), Place(paths[1], new[0].line)
        self._add_code("moved", paths, block.new.new, old, new, *places, self._aspects_of(new))
        for before, after in zip(old, new, strict=True):
            self._targets(block.old_file.old, before, block.new_file.new, after, same_text=True)

    def _lone_part(self, pair: FilePair, part: Part, removed: bool) -> None:
        side, paths = pair.old if removed else pair.new, (pair.old.path, pair.new.path)
        statements = sorted((*part.code, *part.data), key=lambda statement: statement.start)
        place = Place(side.path, statements[0].line) if statements else Place(side.path, 1)
        aspects = ("routine", *self._aspects_of(statements))
        if removed:
            self._add_code("routine", paths, part, statements, [], place, None, aspects)
        else:
            self._add_code("routine", paths, part, [], statements, None, place, aspects)

    # data

    def _data(self, pair: FilePair, data: DataPair) -> None:
        for i, j in data.same:
            self._targets(pair.old, data.old.data[i], pair.new, data.new.data[j], same_text=True)
        for old, new in data.pairs:
            self._datum(pair, data, old, new)
        for statement in data.removed:
            self._lone_datum(pair, data.old, statement, removed=True)
        for statement in data.added:
            self._lone_datum(pair, data.new, statement, removed=False)
        self._order(pair, data)

    def _order(self, pair: FilePair, data: DataPair) -> None:
        places = [{id(item): index for index, item in enumerate(part.data)} for part in (data.old, data.new)]
        edited = [(places[0].get(id(old), -1), places[1].get(id(new), -1)) for old, new in data.pairs]
        order = sorted(pair for pair in (*data.same, *edited) if min(pair) >= 0)
        moved = len(order) - len(increasing([new for _, new in order]))
        if moved:
            self.found.noise.append(Noise("order", pair.new.path, count=moved))

    def _datum(self, pair: FilePair, data: DataPair, old: Statement, new: Statement) -> None:
        dialect = self._dialect
        declared = pair.new.declared(new)
        kind = dialect.noise(new, declared)
        if not kind and self._is_drift(pair, old, new):
            kind = "drift"
        if kind and pair.old.key(old) != pair.new.key(new):
            name = ", ".join(datum.name for datum in declared)
            self.found.noise.append(Noise(kind, pair.new.path, new.line, old.source, new.source, name=name))
            if kind == "drift":
                self._drifted_places(pair, old, new)
            return
        frames = frames_in(pair.old, old), frames_in(pair.new, new)
        common = [name for name in frames[1] if pair.old.names.get(name, name) in frames[0]]
        rounded = self._literals(pair, old, new)
        for name in common:
            change, small = self._frames.changed((pair.old, old, frames[0][name]), (pair.new, new, frames[1][name]))
            rounded |= small
            if change is not None and pair.old.key(old) != pair.new.key(new):
                self.found.frames.append(change)
        masked = [
            key(item, [*side.index.masks(side.path, item), *frame_masks(found, common)], side.names)
            for side, item, found in ((pair.old, old, frames[0]), (pair.new, new, frames[1]))
        ]
        self._verdict(pair, data.new, old, new, masked[0] == masked[1], rounded)

    def _drifted_places(self, pair: FilePair, old: Statement, new: Statement) -> None:
        """Say that a tool, base or target differs, though it may be the program itself that changed it."""
        frames = frames_in(pair.old, old), frames_in(pair.new, new)
        for name in frames[0].keys() & frames[1].keys():
            change, _ = self._frames.changed((pair.old, old, frames[0][name]), (pair.new, new, frames[1][name]))
            if change is not None:
                self._doubt(f"{change.kind} {change.name}", change.shift, pair.new.path, new.line)
        targets = [side.index.targets_in(side.path, item) for side, item in ((pair.old, old), (pair.new, new))]
        for before, after in pair_targets(*targets):
            if before is not None and after is not None:
                moved, _ = self._comparer.target(before, after, same_text=False)
                if moved is not None:
                    self._doubt(f"target {moved.target}", moved.shift, pair.new.path, new.line)

    def _doubt(self, what: str, shift: Shift | None, path: str, line: int) -> None:
        far = "" if shift is None else f" by {shift.distance:.3f} mm, {shift.turn:.4f} deg"
        message = (
            f"{what} differs{far}, and the program writes it while it runs: whether someone edited it cannot be told; "
            "it is counted as noise"
        )
        self.found.issues.append(Issue("RUN_TIME_FRAME", message, path, line))

    def _is_drift(self, pair: FilePair, old: Statement, new: Statement) -> bool:
        """Whether only values differ that the program itself writes and the controller saves, and nobody typed them."""
        dialect = self._dialect
        if not (dialect.persistent(old) and dialect.persistent(new)) or dialect.typed(new):
            return False
        sides = [(pair.old, old, self._old.robot), (pair.new, new, self._new.robot)]
        if not any(robot.writes(side.path, datum.name) for side, item, robot in sides for datum in side.declared(item)):
            return False
        leaves = differing(dialect, [(side.path, item, robot) for side, item, robot in sides])
        parts = [
            part
            for (side, item, _), writes in zip(sides, self._writes, strict=True)
            for datum in side.declared(item)
            for part in writes.parts(side.path, datum.name)
        ]
        return bool(leaves) and all(covered(leaf, parts) for leaf in leaves or ())

    def _lone_datum(self, pair: FilePair, part: Part, statement: Statement, removed: bool) -> None:
        side, paths = pair.old if removed else pair.new, (pair.old.path, pair.new.path)
        place = Place(side.path, statement.line)
        targets = [target for target in side.index.targets_in(side.path, statement) if target.declared]
        frames = frames_in(side, statement)
        kind = self._dialect.noise(statement, side.declared(statement))
        if targets:
            named = [_named(target, side.index) for target in targets]
            (self.found.removed if removed else self.found.added).extend(named)
        elif frames:
            self.found.frames += [
                self._frames.lone(side, statement, value, removed) for value in frames.values()
            ]  # fmt: skip
        elif kind:
            texts = (statement.source, "") if removed else ("", statement.source)
            self.found.noise.append(Noise(kind, side.path, statement.line, *texts))
        elif removed:
            self._add_code("", paths, part, [statement], [], place, None, (self._dialect.about(statement),))
        else:
            self._add_code("", paths, part, [], [statement], None, place, (self._dialect.about(statement),))

    # code

    def _code(self, pair: FilePair, code: CodePair) -> None:
        for i, j in code.pairs:
            old, new = code.old.code[i], code.new.code[j]
            same = old.source == new.source
            if same:
                self._targets(pair.old, old, pair.new, new, same_text=True)
                continue
            kind = self._dialect.noise(new, ())
            if kind:
                self.found.noise.append(Noise(kind, pair.new.path, new.line, old.source, new.source))
                continue
            rounded = self._literals(pair, old, new)
            masked = pair.old.key(old, masked=True) == pair.new.key(new, masked=True)
            self._verdict(pair, code.new, old, new, masked, rounded)
        for i0, i1, j0, j1 in code.gaps():
            self._gap(pair, code, range(i0, i1), range(j0, j1))

    def _gap(self, pair: FilePair, code: CodePair, rows: range, columns: range) -> None:
        old = [code.old.code[row] for row in rows if row not in code.moved_old]
        new = [code.new.code[column] for column in columns if column not in code.moved_new]
        kept: list[list[Statement]] = []
        for side, statements, is_old in ((pair.old, old, True), (pair.new, new, False)):
            kept.append([])
            for statement in statements:
                kind = self._dialect.noise(statement, ())
                if kind:
                    texts = (statement.source, "") if is_old else ("", statement.source)
                    self.found.noise.append(Noise(kind, side.path, statement.line, *texts))
                else:
                    kept[-1].append(statement)
        old, new = kept
        if old or new:
            places = (
                Place(pair.old.path, old[0].line) if old else None,
                Place(pair.new.path, new[0].line) if new else None,
            )
            self._add_code(
                "", (pair.old.path, pair.new.path), code.new, old, new, *places, self._aspects_of((*new, *old))
            )

    def _verdict(
        self, pair: FilePair, part: Part, old: Statement, new: Statement, same_but_places: bool, rounded: bool
    ) -> None:
        """Say what differs beside positions and frames."""
        if not same_but_places:
            places = Place(pair.old.path, old.line), Place(pair.new.path, new.line)
            paths = pair.old.path, pair.new.path
            self._add_code("", paths, part, [old], [new], *places, self._dialect.aspects(old, new))
        elif rounded:
            self.found.noise.append(Noise("rounding", pair.new.path, new.line, old.source, new.source))
        elif pair.old.key(old) == pair.new.key(new) and key(old) == key(new) and old.source != new.source:
            self.found.noise.append(spelled_otherwise(pair.new, old, new))
        elif pair.old.key(old) != pair.new.key(new) and not self._explained(pair, new):
            self.found.noise.append(Noise("spelling", pair.new.path, new.line, old.source, new.source))

    def _explained(self, pair: FilePair, new: Statement) -> bool:
        """Whether a finding about a literal of this statement was made."""
        here = Place(pair.new.path, new.line)
        moved = self.found.moved[-50:]
        return any(item.new == here for item in moved) or any(item.new == here for item in self.found.frames[-5:])

    # literals

    def _literals(self, pair: FilePair, old: Statement, new: Statement) -> bool:
        """Compare the positions of two statements; whether any differs within the tolerance only."""
        rounded = self._targets(pair.old, old, pair.new, new, same_text=False)
        offsets = [
            side.index.offsets_in(side.path, item) for side, item in ((pair.old, old), (pair.new, new))
        ]  # fmt: skip
        if len(offsets[0]) == len(offsets[1]):
            for before, after in zip(*offsets, strict=True):
                moved, small = self._comparer.offset(before, after)
                rounded |= small
                if moved is not None:
                    self.found.moved.append(moved)
        return rounded

    def _targets(self, old_side: Side, old: Statement, new_side: Side, new: Statement, same_text: bool) -> bool:
        before = old_side.index.targets_in(old_side.path, old)
        after = new_side.index.targets_in(new_side.path, new)
        if not before and not after:
            return False
        rounded = False
        for first, second in pair_targets(before, after):
            if first is not None and second is not None:
                rounded |= self._target(first, second, same_text)
            elif first is not None and first.declared:
                self.found.removed.append(_named(first, old_side.index))
            elif second is not None and second.declared:
                self.found.added.append(_named(second, new_side.index))
        return rounded

    def _target(self, old: Target, new: Target, same_text: bool) -> bool:
        self.found.targets += 1
        moved, rounded = self._comparer.target(old, new, same_text)
        if moved is not None:
            self.found.moved.append(moved)
        return rounded

    def _aspects_of(self, statements: Iterable[Statement]) -> tuple[str, ...]:
        return ranked(self._dialect.about(statement) for statement in statements)

    def _add_code(
        self,
        kind: str,
        paths: tuple[str, str],
        part: Part,
        old: Sequence[Statement],
        new: Sequence[Statement],
        old_place: Place | None,
        new_place: Place | None,
        aspects: tuple[str, ...],
    ) -> None:
        self.found.code.append(
            CodeChange(
                path=paths[1],
                old_path=paths[0],
                kind=kind or aspects[0],
                routine=part.title,
                old_lines=_lines(old),
                new_lines=_lines(new),
                old=old_place,
                new=new_place,
                aspects=aspects,
            )
        )


def _both_ways(pair: FilePair) -> tuple[tuple[Side, Side], tuple[Side, Side]]:
    return (pair.old, pair.new), (pair.new, pair.old)


def _lines(statements: Iterable[Statement]) -> list[str]:
    return [line.strip() for statement in statements for line in NEWLINE.split(statement.source)]


def _named(target: Target, index: Index) -> Named:
    file = index.robot.files[target.path]
    text = " ".join(file.source.text[slice(*target.span)].split())
    return Named(target.name, file.program, Place(target.path, target.line), text)
