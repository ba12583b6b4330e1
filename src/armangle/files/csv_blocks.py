"""CSV files read block by block: columns by header, errors with line and column."""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, NoReturn, TextIO

import numpy as np

from .. import _opening
from .._arrays import Floats, PathLike, number_in
from ..errors import ModelError

BLOCK = 8192
"""Number of rows held as text at one time."""

_LONGEST_ROW = 2**16  # characters
_MOST_COLUMNS = 1024

_SEPARATORS = {";": "semicolons", "\t": "tabs"}


@dataclass(frozen=True, eq=False)
class CsvBlock:
    """Some rows of a file: numbers (n, columns), words by name of a column it has, the line of each row."""

    numbers: Floats
    words: dict[str, list[str]]
    lines: list[int]


class RowLines:
    """The lines of a file for csv.reader, with a limit; whoever reads sets `taken` to 0 after each row."""

    def __init__(self, file: TextIO) -> None:
        """Read from an open text file."""
        self.file = file
        self.taken = 0

    def __iter__(self) -> RowLines:
        return self

    def __next__(self) -> str:
        line = self.file.readline(_LONGEST_ROW + 1)
        self.taken += len(line)
        if self.taken > _LONGEST_ROW:
            raise csv.Error(f"a row of more than {_LONGEST_ROW} characters")
        if not line:
            raise StopIteration
        return line


def open_text(path: PathLike, fail: _opening.Fail) -> TextIO:
    """Return a text file of numbers, opened for reading line by line; `fail` raises for a reason."""
    file = _opening.open_file(path, _opening.NUMBERS, fail)
    return io.TextIOWrapper(file, encoding="utf-8-sig", newline="")


class CsvFile:
    """A CSV file with a header, read in blocks.

    `required` and then `optional` are columns of numbers, in the order of `CsvBlock.numbers`, NaN for a
    missing optional one; `words` are optional columns of text. All other columns are ignored. If `lost`,
    cells for numbers may be empty: these are NaN. Otherwise rows of empty cells only end a file. Raises
    `ModelError` with file, line and column (the number of the field, from 1).
    """

    def __init__(
        self,
        path: PathLike,
        required: Sequence[str],
        optional: Sequence[str] = (),
        words: Sequence[str] = (),
        *,
        lost: bool = False,
    ) -> None:
        """Set which columns a file must and may have; it is opened by `blocks`, which raises."""
        self.path = path
        self.lost = lost
        self.required = tuple(required)
        self.numbers = (*required, *optional)
        self.words = tuple(words)
        self.at: dict[str, int] = {}

    def fail(self, message: str, line: int | None = None, name: str | None = None) -> NoReturn:
        """Raise a ModelError with a line and the number of a column, which must be in the header."""
        column = None if name is None else self.at[name] + 1
        raise ModelError(message, source=str(self.path), line=line, column=column)

    def blocks(self) -> Iterator[CsvBlock]:
        """Yield the rows, at most `BLOCK` at a time."""
        try:
            with open_text(self.path, self.fail) as file:
                yield from self._blocks(file)
        except UnicodeDecodeError as error:
            self.fail(f"not UTF-8 text: {error.reason}")
        except OSError as error:
            self.fail(f"cannot be read: {error.strerror}")

    def _blocks(self, file: TextIO) -> Iterator[CsvBlock]:
        """Yield the rows of an open file, at most `BLOCK` at a time."""
        lines_of_row = RowLines(file)
        reader: Any = csv.reader(lines_of_row, strict=True)
        width = 0
        rows: list[list[str]] = []
        lines: list[int] = []
        blank: int | None = None
        try:
            for row in reader:
                lines_of_row.taken = 0
                holds = bool("".join(row).strip())
                if not holds and (len(row) < 2 or not width):
                    continue
                if not width:
                    width = self._header(row, reader.line_num)
                    continue
                if not holds and not self.lost:
                    blank = blank or reader.line_num
                    continue
                if blank:
                    self.fail("a row of empty cells, wanted numbers, or an empty line", blank)
                if len(row) != width:
                    self.fail(f"{len(row)} fields, wanted {width} as in the header", reader.line_num)
                rows.append(row)
                lines.append(reader.line_num)
                if len(rows) == BLOCK:
                    yield self._block(rows, lines)
                    rows, lines = [], []
        except csv.Error as error:
            self.fail(f"not CSV: {error}", reader.line_num)
        if not width:
            self.fail(f"empty, wanted a header with {','.join(self.required)}", 1)
        if rows:
            yield self._block(rows, lines)

    def _header(self, row: list[str], line: int) -> int:
        """Find the columns in the header row and return how many cells each row has; raise if
        one is missing.
        """
        if len(row) > _MOST_COLUMNS:
            self.fail(f"{len(row)} columns, wanted at most {_MOST_COLUMNS}", line)
        names = [name.strip() for name in row]
        for name in (*self.numbers, *self.words):
            if names.count(name) > 1:
                self.fail(f"column {name} is there {names.count(name)} times", line)
        self.at = {name: names.index(name) for name in names if name in (*self.numbers, *self.words)}
        missing = [name for name in self.required if name not in self.at]
        if missing:
            self.fail(f"missing column {', '.join(missing)}; {_hint(names, missing, self.at)}", line)
        return len(row)

    def _block(self, rows: list[list[str]], lines: list[int]) -> CsvBlock:
        """Return rows of cells as numbers (NaN for empty ones if `lost`) and words; raise for no number."""
        columns = list(zip(*rows, strict=True))
        numbers = np.full((len(rows), len(self.numbers)), np.nan)
        for k, name in enumerate(self.numbers):
            if name in self.at:
                cells = columns[self.at[name]]
                if self.lost:
                    cells = tuple(cell if cell.strip() else "nan" for cell in cells)
                try:
                    numbers[:, k] = [number_in(cell) for cell in cells]
                except ValueError:
                    self._fail_at_word(name, cells, lines)
        words = {name: [c.strip() for c in columns[self.at[name]]] for name in self.words if name in self.at}
        return CsvBlock(numbers, words, lines)

    def _fail_at_word(self, name: str, cells: Sequence[str], lines: list[int]) -> NoReturn:
        """Raise at the first cell of a column that is no number."""
        for cell, line in zip(cells, lines, strict=True):
            try:
                number_in(cell)
            except ValueError:
                what = f"is {cell.strip()!r}" if cell.strip() else "is empty"
                self.fail(f"{name} {what}, wanted a number", line, name)
        raise AssertionError(name)


def _hint(names: list[str], missing: list[str], known: Collection[str]) -> str:
    """Return in words a wrong separator, or the names with one, not `known`, similar to a missing one."""
    for separator, word in _SEPARATORS.items():
        if separator in names[0]:
            return f"the file seems to be separated by {word}, wanted commas"
    free = [name for name in names if name not in known]
    listed = f"the header has {', '.join(repr(name) for name in names)}"
    for name in missing:
        for close in get_close_matches(name, free, n=1):
            return f"{listed}; column {close!r} may be meant for {name!r}: rename {close!r} to {name!r}"
    return listed
