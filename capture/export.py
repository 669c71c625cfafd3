"""Write a table of a capture to a file: CSV with the standard library, Parquet with pyarrow where it is installed.

The typed function behind `foosim capture export`. The capture is read once, with one batch of the table in memory.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, Final, Literal, TextIO

from foosim.capture.new_file import check_name, new_file
from foosim.capture.reader import Scan, deployment_of
from foosim.capture.tables import Column, Kind, Table, table_of
from foosim.common.errors import BadValue, Failed

Format = Literal["csv", "parquet"]
FORMATS: Final[tuple[Format, ...]] = ("csv", "parquet")
STANDARD_OUTPUT: Final = Path("-")
BATCH_ROWS: Final = 10_000
BATCH_BYTES: Final = 8 * 1024 * 1024
"""A batch ends at either; it is a row group of a Parquet file."""


class NoParquet(Failed):
    """The library that writes Parquet is not installed."""


@dataclass(frozen=True, slots=True)
class Exported:
    """What was written: the table's columns, and how many rows."""

    path: Path
    columns: tuple[Column, ...]
    rows: int


def export_capture(path: Path, what: str, out: Path, form: Format | None = None) -> Exported:
    """Write the table `what` of a capture to `out`, `-` being standard output, as CSV or Parquet.

    Without `form` the name of `out` decides. Raises BadValue for an unknown table or format, NoParquet, Existing,
    CaptureError when the capture cannot be read, Failed when the file cannot be written.
    """
    if form is None and out != STANDARD_OUTPUT:
        check_name("--out", out, "a table without --format", tuple(f".{known}" for known in FORMATS))
    form = form or ("parquet" if out.suffix.lower() == ".parquet" else "csv")
    if form not in FORMATS:
        raise BadValue(f"--format: not one of {', '.join(FORMATS)}", form)
    if form == "parquet" and out == STANDARD_OUTPUT:
        raise BadValue("-o: a Parquet file is not written to standard output", str(out))
    scan = Scan(path)
    messages = scan.messages()
    first = next(messages, None)
    deployment = deployment_of(scan.about)
    table = table_of(what, deployment)
    rows = 0
    with _sink(table, out, form) as sink:
        batch: list[tuple[Any, ...]] = []
        size = 0
        for message in chain([] if first is None else [first], messages):
            if message.topic != table.topic:
                continue
            for row in table.rows(scan.decode, message):
                batch.append(row)
                size += len(message.data)
            if len(batch) >= BATCH_ROWS or size >= BATCH_BYTES:
                sink.write(batch)
                rows += len(batch)
                batch, size = [], 0
        sink.write(batch)
        rows += len(batch)
    return Exported(out, table.columns, rows)


@contextmanager
def _sink(table: Table, out: Path, form: Format) -> Iterator[CsvSink | ParquetSink]:
    """Open what takes the rows; a file gets its name when it is whole."""
    if out == STANDARD_OUTPUT:
        yield CsvSink(sys.stdout, table.columns)
        sys.stdout.flush()
        return
    with new_file(out) as part:
        if form == "parquet":
            sink: CsvSink | ParquetSink = ParquetSink(part, table)
        else:
            sink = CsvSink(part.open("w", encoding="utf-8", newline=""), table.columns)
        try:
            yield sink
        finally:
            sink.close()


class CsvSink:
    """CSV in UTF-8 with a line of names: RFC 4180 but for the ends of lines. Bytes are in hex, missing values empty.

    A number is written with the digits that give it back exactly.
    """

    def __init__(self, stream: TextIO, columns: tuple[Column, ...]) -> None:
        self._stream = stream
        self._writer = csv.writer(stream, lineterminator="\n")
        self._binary = [index for index, column in enumerate(columns) if column.kind == "bytes"]
        self._boolean = [index for index, column in enumerate(columns) if column.kind == "boolean"]
        self._writer.writerow([column.name for column in columns])

    def write(self, rows: list[tuple[Any, ...]]) -> None:
        if not self._binary and not self._boolean:
            self._writer.writerows(rows)
            return
        for row in rows:
            values = list(row)
            for index in self._binary:
                values[index] = values[index].hex()
            for index in self._boolean:
                values[index] = "true" if values[index] else "false"
            self._writer.writerow(values)

    def close(self) -> None:
        self._stream.close()


class ParquetSink:
    """Parquet by pyarrow, a row group for each batch; units are in the metadata of the columns."""

    def __init__(self, path: Path, table: Table) -> None:
        try:
            import pyarrow
            from pyarrow import parquet
        except ImportError:
            raise NoParquet("Parquet needs pyarrow: pip install 'foosim[parquet]', or --format csv") from None
        self._arrow = pyarrow
        types: dict[Kind, Any] = {
            "integer": pyarrow.int64(),
            "number": pyarrow.float64(),
            "text": pyarrow.string(),
            "bytes": pyarrow.binary(),
            "boolean": pyarrow.bool_(),
            "json": pyarrow.string(),
        }
        self._schema = pyarrow.schema(
            [
                pyarrow.field(column.name, types[column.kind], metadata={"unit": column.unit} if column.unit else None)
                for column in table.columns
            ],
            metadata={"foosim.table": table.name},
        )
        self._writer = parquet.ParquetWriter(str(path), self._schema, compression="zstd")

    def write(self, rows: list[tuple[Any, ...]]) -> None:
        if rows:
            columns = [list(column) for column in zip(*rows, strict=True)]
            arrays = [
                self._arrow.array(column, field.type) for column, field in zip(columns, self._schema, strict=True)
            ]
            self._writer.write_batch(self._arrow.record_batch(arrays, schema=self._schema))

    def close(self) -> None:
        self._writer.close()
