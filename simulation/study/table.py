"""The results of a study: a table with a row for each run, in a file of CSV, JSON lines or Parquet.

The columns are the parameters (a value as it was given), `seed`, the metrics, then those of `LAST`. A run that failed
has a `message` and no figures. `study` and `foosim` are the identity of the study and the version that ran it.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
from numpy.typing import NDArray

from foosim.capture.new_file import written
from foosim.common.errors import BadValue, Failed, UnknownName
from foosim.simulation.study.study import SEED

FATES: Final = ("offered", "delivered", "dropped", "in_flight", "refused")
COUNTS: Final = ("ticks", *(f"packets.{fate}" for fate in FATES))
TEXTS: Final = ("digest", "message", "study", "foosim")
LAST: Final = (*COUNTS, *TEXTS)
ENDINGS: Final = (".csv", ".jsonl", ".parquet")

Row = dict[str, Any]


@dataclass(slots=True)
class Table:
    """The parameters of a study and its rows, each with a value for every column it has."""

    parameters: tuple[str, ...]
    rows: list[Row] = field(default_factory=list)

    @property
    def metrics(self) -> tuple[str, ...]:
        """The names of the metrics, in order."""
        others = {*self.parameters, SEED, *LAST}
        return tuple(sorted({name for row in self.rows for name in row if name not in others}))

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of all columns, in their order."""
        return (*self.parameters, SEED, *self.metrics, *LAST)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a column as an array; of a figure NaN, of a text None, where a run has none. Raises UnknownName."""
        if name not in self.columns:
            raise UnknownName("no column of the table", name, self.columns)
        values = [row.get(name) for row in self.rows]
        kind = object if name in (*self.parameters, *TEXTS) else int if name == SEED else float
        return np.array(values, kind)

    def to_pandas(self) -> Any:
        """Return a data frame of pandas, which is installed apart from foosim."""
        frame: Any = import_module("pandas").DataFrame(self.rows, columns=list(self.columns))
        return frame

    def key(self, row: Mapping[str, Any]) -> tuple[Any, ...]:
        """Return the values and the seed of a row's run."""
        return (*(row[name] for name in self.parameters), row[SEED])


def check_results(path: Path) -> None:
    """Refuse a file that cannot be one of results by its name. Raises BadValue, and Failed where pyarrow is absent."""
    if path.suffix not in ENDINGS:
        raise BadValue(f"the name of a results file ends with {', '.join(ENDINGS)}", str(path))
    if path.suffix == ".parquet" and find_spec("pyarrow") is None:
        raise Failed(f"{path}: Parquet needs pyarrow: pip install 'foosim[parquet]'")


def write_table(path: Path, table: Table) -> None:
    """Write a table in place of another one; its file is whole at any time. Raises Failed."""
    columns = table.columns
    rows = [{name: row.get(name) for name in columns} for row in table.rows]
    with written(path) as part:
        if path.suffix == ".csv":
            with part.open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow(columns)
                writer.writerows([row.values() for row in rows])
        elif path.suffix == ".jsonl":
            part.write_bytes(msgspec.json.Encoder().encode_lines(rows))
        else:
            import pyarrow
            from pyarrow import parquet

            types = {name: pyarrow.string() for name in (*table.parameters, *TEXTS)}
            types |= {name: pyarrow.int64() for name in (SEED, *COUNTS)}
            schema = pyarrow.schema([(name, types.get(name, pyarrow.float64())) for name in columns])
            parquet.write_table(pyarrow.Table.from_pylist(rows, schema), part)


def read_table(path: Path) -> Table:
    """Return the table in a results file. Raises BadValue for another file, Failed for one that cannot be read."""
    check_results(path)
    try:
        rows = _rows(path)
    except OSError as error:
        raise Failed(f"{path}: cannot be read, {error.strerror or error}") from None
    except (ValueError, csv.Error, msgspec.DecodeError) as error:
        raise BadValue(f"{path}: not a results file of a sweep: {error}") from None
    columns = list(rows[0]) if rows else []
    if columns[-len(LAST) :] != list(LAST) or SEED not in columns:
        raise BadValue(f"{path}: not a results file of a sweep, which has a row or more and the columns seed to foosim")
    table = Table(tuple(columns[: columns.index(SEED)]))
    known: set[tuple[Any, ...]] = set()
    for number, row in enumerate(rows, 1):
        try:
            if row.keys() != rows[0].keys():
                raise ValueError("its columns are not those of the first row")
            found = _read_row(table.parameters, row)
        except (ValueError, TypeError, OverflowError) as error:
            raise BadValue(f"{path}: row {number}: {error}") from None
        if (key := table.key(found)) in known:
            raise BadValue(f"{path}: row {number}: an earlier row has its parameters and its seed")
        known.add(key)
        table.rows.append(found)
    return table


def _rows(path: Path) -> list[dict[str, Any]]:
    if path.suffix == ".csv":
        with path.open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file, strict=True))
    if path.suffix == ".jsonl":
        return msgspec.json.Decoder(dict[str, Any]).decode_lines(path.read_bytes())
    from pyarrow import parquet

    found: list[dict[str, Any]] = parquet.read_table(path).to_pylist()
    return found


def _read_row(parameters: Sequence[str], row: Mapping[str, Any]) -> Row:
    """Return a row with numbers for texts, as of CSV; figures that a failed run lacks are left out.

    Raises ValueError, TypeError and OverflowError for a value of another type.
    """
    found: Row = {}
    for name, value in row.items():
        if name in parameters or name in TEXTS:
            if not isinstance(value, str):
                raise ValueError(f"{name} is no text")
            found[name] = value
        elif name == SEED or value not in ("", None):
            found[name] = int(value) if name in (SEED, *COUNTS) else float(value)
    return found
