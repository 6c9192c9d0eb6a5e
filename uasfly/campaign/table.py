"""The results as a table: one row a flight, in the order of the campaign, as Parquet."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from uasfly.campaign.campaign_file import Success
from uasfly.campaign.flights import Flight, FlightList
from uasfly.campaign.fly import TIMING, Result

Row = dict[str, Any]

_TEXT, _WHOLE, _NUMBER, _FLAG = "text", "whole", "number", "flag"
WHAT: Mapping[str, str] = {
    "index": _WHOLE,
    "id": _TEXT,
    "airframe": _TEXT,
    "mission": _TEXT,
    "scenario": _TEXT,
    "controller": _TEXT,
    "seed": _WHOLE,
    "wind_m_s": _NUMBER,
}
HOW: Mapping[str, str] = {
    "outcome": _TEXT,
    "reason": _TEXT,
    "success": _FLAG,
    "duration_s": _NUMBER,
    "tracking_rms_x_m": _NUMBER,
    "tracking_rms_y_m": _NUMBER,
    "tracking_rms_z_m": _NUMBER,
    "tracking_rms_m": _NUMBER,
    "tracking_max_m": _NUMBER,
    "estimate_rms_m": _NUMBER,
    "gnss_rms_m": _NUMBER,
    "fallback_steps": _WHOLE,
    "rejected": _WHOLE,
    "rejected_by_kind": _TEXT,
    "force_x_m_s2": _NUMBER,
    "force_y_m_s2": _NUMBER,
    "force_z_m_s2": _NUMBER,
    "warnings": _TEXT,
    "command": _TEXT,
    **{f"{TIMING}{name}_{q}_ms": _NUMBER for name in ("solve", "cycle") for q in ("median", "p99", "max")},
    f"{TIMING}real_time_factor": _NUMBER,
    f"{TIMING}wall_s": _NUMBER,
    f"{TIMING}worker": _TEXT,
}


def rows_of(flights: FlightList, results: Mapping[str, Result]) -> list[Row]:
    """Rows of the flights that have a result, in the order of the campaign.

    What was flown comes from the campaign file as it is now, only what came of it from the results: so a campaign file
    may be made longer, put in another order or given another measure of success without flying anything again.
    """
    success = flights.campaign.success
    return [
        _row(flight, results[flight.id], success, flights.command(flight))
        for flight in flights.flights
        if flight.id in results
    ]


def succeeded(result: Result, success: Success) -> bool:
    """Whether a flight counts as a success, see `Success`."""
    if result["outcome"] != "completed":
        return False
    rms = result.get("tracking_rms_m")
    return success.tracking_rms_m is None or (rms is not None and rms <= success.tracking_rms_m)


def write_parquet(path: Path, rows: Sequence[Row], fields: Sequence[str]) -> None:
    """Write rows; the fields that the campaign changes are columns by their own names.

    A changed field is a column of numbers where all its values are, and of JSON otherwise.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    kinds = {_TEXT: pa.string(), _WHOLE: pa.int64(), _NUMBER: pa.float64(), _FLAG: pa.bool_()}
    numeric = {field: all(_is_number(row[field]) for row in rows) for field in fields}
    schema = pa.schema(
        [
            *(pa.field(name, kinds[kind]) for name, kind in WHAT.items()),
            *(pa.field(name, pa.float64() if numeric[name] else pa.string()) for name in fields),
            *(pa.field(name, kinds[kind]) for name, kind in HOW.items()),
        ]
    )
    texts = [field for field in fields if not numeric[field]]
    plain = [{**row, **{field: json.dumps(row[field]) for field in texts}} for row in rows]
    pq.write_table(pa.Table.from_pylist(plain, schema=schema), path)


def read_parquet(path: Path) -> list[Row]:
    """The rows of a file."""
    import pyarrow.parquet as pq

    rows: list[Row] = pq.read_table(path).to_pylist()
    return rows


def same_rows(first: Sequence[Row], second: Sequence[Row]) -> bool:
    """Whether two runs of a campaign gave the same rows, bit for bit; columns that tell of the machine are left out."""
    return [without_timing(row) for row in first] == [without_timing(row) for row in second]


def without_timing(row: Row) -> Row:
    """A row without the columns that tell of the machine."""
    return {name: value for name, value in row.items() if not name.startswith(TIMING)}


def _row(flight: Flight, result: Result, success: Success, command: str) -> Row:
    what = {name: getattr(flight, name) for name in WHAT}
    how: Row = {name: result.get(name) for name in HOW}
    how["success"], how["command"] = succeeded(result, success), command
    return {**what, **dict(flight.values), **how}


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
