"""The statements of a program file on both sides: every difference is a finding or noise, none is left out."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from respot.difference.alignment import increasing
from respot.difference.blocks import Block
from respot.difference.canonical import key, plain_tokens
from respot.difference.dialect import Datum, ranked
from respot.difference.dialects import DIALECTS
from respot.difference.drift import Writes, covered, differing
from respot.difference.findings import CodeChange, Named, Noise, Place, RobotDifference, Shift
from respot.difference.frames import FrameComparer, frame_masks, frames_in
from respot.difference.index import Index
from respot.difference.noise import layout, remarks, spelled_otherwise
from respot.difference.parts import Part
from respot.difference.positions import Comparer, Tolerance, pair_targets
from respot.difference.programs import CodePair, DataPair, FilePair, Side
from respot.issues import Issue
from respot.program.statement import Statement
from respot.program.targets import Target
from respot.source import NEWLINE

#: A line end that some take for none; controllers write CR LF.
_LONE_RETURN = re.compile(r"\r(?![\r\n])")


class StatementComparison:
    """Compares the statements of one robot's files.

    Parameters
    ----------
    old, new : Index
        Both states of the robot.
    tolerance : Tolerance
        What counts as the same place.
    found : RobotDifference
        Where the findings go.
    """

    def __init__(self, old: Index, new: Index, tolerance: Tolerance, found: RobotDifference) -> None:
        self._dialect = DIALECTS[new.robot.language]
        self._comparer = Comparer(old, new, tolerance)
        self._frames = FrameComparer(old, new, tolerance)
        self._writes = Writes(old.robot, self._dialect), Writes(new.robot, self._dialect)
        self.found = found

    def file(self, pair: FilePair, blocks: Sequence[Block]) -> None:
        """Compare a file; ``blocks`` are those that moved into it."""
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
        self._first_routine(pair)
        self._code_page(pair)
        self._lone_returns(pair)
        if before == self._counts() and not pair.old.names:
            self.found.noise.append(Noise("blanks", pair.new.path))

    def _first_routine(self, pair: FilePair) -> None:
        """Say that another routine is the one that is started, though both are there on both sides."""
        if not self._dialect.first_is_main:
            return
        routines = [[part for part in side.parts.values() if part.head is not None] for side in (pair.old, pair.new)]
        if not routines[0] or not routines[1]:
            return
        old, new = routines[0][0], routines[1][0]
        partners = {id(first): second for first, second in pair.parts}
        if partners.get(id(old), new) is new or old.head is None or new.head is None:
            return
        places = Place(pair.old.path, old.head.line), Place(pair.new.path, new.head.line)
        self._add_code("", (pair.old.path, pair.new.path), new, [old.head], [new.head], *places, ("flow",))

    def _code_page(self, pair: FilePair) -> None:
        """Say that names or texts are other bytes, which a controller takes for other letters."""
        sources = pair.old.file.source, pair.new.file.source
        pages = [source.encoding for source in sources]
        if pages[0] == pages[1] or "ascii" in pages:
            return
        quiet = self._dialect.comments | self._dialect.folds
        for statement in pair.new.file.statements:
            if statement.kind not in quiet and not "".join(plain_tokens(statement)).isascii():
                change = CodeChange(
                    path=pair.new.path,
                    old_path=pair.old.path,
                    kind="encoding",
                    routine="",
                    old_lines=[f"code page {pages[0]}"],
                    new_lines=[f"code page {pages[1]}: {_lines([statement])[0]}"],
                    old=Place(pair.old.path, 1),
                    new=Place(pair.new.path, statement.line),
                    aspects=("encoding",),
                )
                self.found.code.append(change)
                return

    def _lone_returns(self, pair: FilePair) -> None:
        """Say that lines end that did not: of a return without a line feed nobody knows whether a controller obeys."""
        sources = pair.old.file.source, pair.new.file.source
        found = [
            [] if source.newline == "\r" else [match.start() for match in _LONE_RETURN.finditer(source.text)]
            for source in sources
        ]  # fmt: skip
        if len(found[0]) == len(found[1]):
            return
        lines, places = [], []
        for source, starts in zip(sources, found, strict=True):
            line = NEWLINE.split(source.text[: starts[0]])[-1] if starts else ""
            lines.append([f"{len(starts)} returns without a line feed: {line}".rstrip(" :")])
            places.append(Place(source.path, len(NEWLINE.split(source.text[: starts[0]])) if starts else 1))
        change = CodeChange(
            pair.new.path, pair.old.path, "encoding", "", lines[0], lines[1], places[0], places[1], ("encoding",)
        )
        self.found.code.append(change)

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
            self._overwritten(pair, data, order)

    def _overwritten(self, pair: FilePair, data: DataPair, order: Sequence[tuple[int, int]]) -> None:
        """Say that what is given a value again and again gets its values in another order: the last one stays."""
        groups: dict[str, list[tuple[int, int]]] = {}
        for i, j in order:
            for datum in pair.new.declared(data.new.data[j]):
                groups.setdefault(datum.name, []).append((i, j))
        for found in groups.values():
            news = sorted(j for _, j in found)
            if news != [j for _, j in found]:
                old, new = [data.old.data[i] for i, _ in found], [data.new.data[j] for j in news]
                places = Place(pair.old.path, old[0].line), Place(pair.new.path, new[0].line)
                aspects = self._aspects_of(new)
                self._add_code("", (pair.old.path, pair.new.path), data.new, old, new, *places, aspects)

    def _datum(self, pair: FilePair, data: DataPair, old: Statement, new: Statement) -> None:
        declared = pair.new.declared(new)
        kind = self._noise(old, pair.old.declared(old)) and self._noise(new, declared)
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
        before = self._places()
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
        self._verdict(pair, data.new, old, new, masked[0] == masked[1], rounded, self._places() > before)

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

    def _noise(self, statement: Statement, declared: Sequence[Datum]) -> str:
        """Return what noise a statement is; what no form but the code reads is none."""
        kind = self._dialect.noise(statement, declared)
        if kind == "last_used" and any(
            datum.name.partition("[")[0] in writes.last_used for datum in declared for writes in self._writes
        ):
            return ""
        return kind

    def _is_drift(self, pair: FilePair, old: Statement, new: Statement) -> bool:
        """Whether only values differ that the program itself writes and the controller saves, and nobody typed them."""
        dialect = self._dialect
        if not (dialect.persistent(old) and dialect.persistent(new)) or dialect.typed(new):
            return False
        sides = [(pair.old, old, self._writes[0]), (pair.new, new, self._writes[1])]
        parts = [
            part
            for side, item, writes in sides
            for datum in side.declared(item)
            for part in writes.parts(side.path, datum.name)
        ]
        leaves = differing(dialect, [(side.path, item, writes) for side, item, writes in sides]) if parts else None
        return bool(leaves) and all(covered(leaf, parts) for leaf in leaves or ())

    def _lone_datum(self, pair: FilePair, part: Part, statement: Statement, removed: bool) -> None:
        side, paths = pair.old if removed else pair.new, (pair.old.path, pair.new.path)
        place = Place(side.path, statement.line)
        targets = [target for target in side.index.targets_in(side.path, statement) if target.declared]
        frames = frames_in(side, statement)
        kind = self._noise(statement, side.declared(statement))
        if targets:
            lone = [named(target, side.index) for target in targets]
            (self.found.removed if removed else self.found.added).extend(lone)
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
            kind = self._noise(old, ()) and self._noise(new, ())
            if kind:
                self.found.noise.append(Noise(kind, pair.new.path, new.line, old.source, new.source))
                continue
            before = self._places()
            rounded = self._literals(pair, old, new)
            masked = pair.old.key(old, masked=True) == pair.new.key(new, masked=True)
            self._verdict(pair, code.new, old, new, masked, rounded, self._places() > before)
        for i0, i1, j0, j1 in code.gaps():
            self._gap(pair, code, range(i0, i1), range(j0, j1))

    def _gap(self, pair: FilePair, code: CodePair, rows: range, columns: range) -> None:
        old = [code.old.code[row] for row in rows if row not in code.moved_old]
        new = [code.new.code[column] for column in columns if column not in code.moved_new]
        kept: list[list[Statement]] = []
        for side, statements, is_old in ((pair.old, old, True), (pair.new, new, False)):
            kept.append([])
            for statement in statements:
                kind = self._noise(statement, ())
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
        self,
        pair: FilePair,
        part: Part,
        old: Statement,
        new: Statement,
        same_but_places: bool,
        rounded: bool,
        told: bool,
    ) -> None:
        """Say what differs beside positions and frames; ``told`` is whether one of these was found to differ."""
        if not same_but_places:
            places = Place(pair.old.path, old.line), Place(pair.new.path, new.line)
            paths = pair.old.path, pair.new.path
            self._add_code("", paths, part, [old], [new], *places, self._dialect.aspects(old, new))
        elif rounded:
            self.found.noise.append(Noise("rounding", pair.new.path, new.line, old.source, new.source))
        elif pair.old.key(old) == pair.new.key(new) and key(old) == key(new) and old.source != new.source:
            self.found.noise.append(spelled_otherwise(pair.new, old, new))
        elif pair.old.key(old) != pair.new.key(new) and not told:
            self.found.noise.append(Noise("spelling", pair.new.path, new.line, old.source, new.source))

    def _places(self) -> int:
        """Count what was found of positions and frames so far."""
        return len(self.found.moved) + len(self.found.frames)

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
                rounded |= self.target(first, second, same_text)
            elif first is not None and first.declared:
                self.found.removed.append(named(first, old_side.index))
            elif second is not None and second.declared:
                self.found.added.append(named(second, new_side.index))
        return rounded

    def target(self, old: Target, new: Target, same_text: bool) -> bool:
        """Compare a target; whether its numbers differ within the tolerance only."""
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


def named(target: Target, index: Index) -> Named:
    """Return a target that came or went."""
    file = index.robot.files[target.path]
    text = " ".join(file.source.text[slice(*target.span)].split())
    return Named(target.name, file.program, Place(target.path, target.line), text)
