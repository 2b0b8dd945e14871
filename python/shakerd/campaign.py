"""A campaign's database, read (record/README.md says what is in it). Also while the daemon writes it."""
from __future__ import annotations

import array
import dataclasses
import hashlib
import json
import os
import pathlib
import sqlite3
import struct
from typing import Any, Iterator, Optional, Union

try:
    import numpy
except ImportError:  # arrays of the standard library then
    numpy = None  # type: ignore[assignment]

Document = dict[str, Any]
PathLike = Union[str, "os.PathLike[str]"]
Doubles = Any  # numpy.ndarray of float64, or array.array('d')

APPLICATION_ID = 0x5348414B  # "SHAK"
NEWEST_LAYOUT = 4
SAMPLE = struct.Struct("<qdBB")  # time in ns, value in SI, channel, quality
CHANNELS = ("displacement", "excitation", "acceleration", "force",
            "aux1", "aux2", "aux3", "aux4", "aux5", "aux6", "aux7", "aux8")
UNITS = {"displacement": "m", "excitation": "m/s^2", "acceleration": "m/s^2", "force": "N"}
GOOD = 0  # a sample's quality: measured, and inside the sensor's range


class NotACampaign(ValueError):
    """The file is no campaign of shakerd, or one of a newer version."""


@dataclasses.dataclass(frozen=True)
class Run:
    """One dwell. `index` counts from 0; `cycles_wanted` is what the campaign asked for."""
    index: int
    name: str
    frequency_hz: float
    amplitude: float  # m/s^2
    cycles_wanted: int


@dataclasses.dataclass(frozen=True)
class Cycle:
    """One whole period on equal steps of phase. `excitation_error` is the standard error of a harmonic."""
    run: str
    index: int
    accepted: bool
    frequency_hz: float
    amplitude: float  # m/s^2
    displacement: Doubles  # m
    excitation: Doubles  # m/s^2
    excitation_error: float  # m/s^2


@dataclasses.dataclass(frozen=True)
class Fact:
    """Where the numbers come from: a file, a program, a person, the specimen, a sensor, a note."""
    of: str  # "rig file", "program", "specimen", "note", ...
    what: str  # of a file: its path; of a note: its author
    value: str  # of a file: its whole text
    utc: str
    sha256: str  # of the value, as it is in the database

    def holds(self) -> bool:
        """Whether the hash is that of the value."""
        return hashlib.sha256(self.value.encode()).hexdigest() == self.sha256


def open_campaign(file: PathLike) -> Campaign:
    """Raises FileNotFoundError, or NotACampaign with the reason."""
    return Campaign(file)


class Campaign:
    """Reads; never writes. Close it, or use it in a `with`."""

    def __init__(self, file: PathLike) -> None:
        self.file = pathlib.Path(file)
        if self.file.is_dir():
            raise NotACampaign(f"{self.file}: is a folder; give one of its databases (.db), or use open_folder")
        if not self.file.is_file():
            raise FileNotFoundError(f"{self.file}: there is no such file")
        self._database = sqlite3.connect(f"{self.file.absolute().as_uri()}?mode=ro", uri=True)
        try:
            (application,), = self._database.execute("PRAGMA application_id")
            (layout,), = self._database.execute("PRAGMA user_version")
            if application != APPLICATION_ID:
                raise NotACampaign(f"{self.file}: is no campaign database of shakerd")
            if layout > NEWEST_LAYOUT:
                raise NotACampaign(f"{self.file}: was written by a newer shakerd (layout {layout}, this "
                                   f"reads up to {NEWEST_LAYOUT})")
            row = self._database.execute("SELECT name, started_utc, finished_utc, status, rig, spec_json, "
                                         "model_json FROM campaign").fetchone()
        except sqlite3.DatabaseError as trouble:
            self._database.close()
            raise NotACampaign(f"{self.file}: {trouble}") from trouble
        except NotACampaign:
            self._database.close()
            raise
        if row is None:
            self._database.close()
            raise NotACampaign(f"{self.file}: the campaign had not begun")
        self.name, self.started_utc, self.finished_utc, self.status, self.rig = row[:5]
        self.spec: Document = json.loads(row[5])
        self.model: Document = json.loads(row[6])
        self.runs = [Run(*found) for found in self._database.execute(
            "SELECT idx, name, frequency_hz, amplitude, cycles_wanted FROM run ORDER BY idx")]

    def __enter__(self) -> Campaign:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the reading of the file; what was read stays."""
        self._database.close()

    def __repr__(self) -> str:
        return f"<Campaign {self.name!r} of {self.started_utc}, {self.status}, {len(self.runs)} runs>"

    # --- what was measured

    def channels(self) -> dict[str, str]:
        """Each recorded channel and its unit; auxiliary channels by the rig's own names."""
        labels = self._labels()
        found = self._database.execute("SELECT data FROM sample")
        seen = sorted({channel for (data,) in found for channel in set(data[16::SAMPLE.size])})
        return {labels[c][0]: labels[c][1] for c in seen}

    def samples(self, run: Union[str, int], channel: str, *, bad: bool = False) -> tuple[Doubles, Doubles]:
        """Times (s, from the first sample of the run) and values (SI) as they came from the sensor.

        Samples that the sensor or its range marked as bad are left out unless `bad`. Raises KeyError
        for a run or a channel that is not there.
        """
        wanted = self._channel(channel)
        index = self._run(run).index
        times, values, first = array.array("d"), array.array("d"), None
        for (data,) in self._database.execute("SELECT data FROM sample WHERE run = ? ORDER BY id", (index,)):
            for t_ns, value, which, quality in SAMPLE.iter_unpack(data):
                first = t_ns if first is None else first
                if which == wanted and (bad or quality == GOOD):
                    times.append((t_ns - first) * 1e-9)
                    values.append(value)
        return _doubles(times), _doubles(values)

    def cycles(self, run: Optional[Union[str, int]] = None, *, accepted: Optional[bool] = None) -> Iterator[Cycle]:
        """The periods of a run, or of all, in order; `accepted` picks those that were, or were not."""
        names = {r.index: r.name for r in self.runs}
        wanted = None if run is None else self._run(run).index
        columns = {row[1] for row in self._database.execute("PRAGMA table_info(cycle)")}
        error = "excitation_error" if "excitation_error" in columns else "0.0"
        for row in self._database.execute(
                "SELECT run, idx, accepted, frequency_hz, amplitude, displacement, excitation, "
                f"{error} FROM cycle ORDER BY run, idx"):
            if wanted is not None and row[0] != wanted or accepted is not None and bool(row[2]) != accepted:
                continue
            yield Cycle(names[row[0]], row[1], bool(row[2]), row[3], row[4], _from_blob(row[5]),
                        _from_blob(row[6]), row[7])

    def facts(self) -> list[Fact]:
        """In the order of their writing; none in a file of a layout before 4 without notes."""
        tables = {name for (name,) in self._database.execute("SELECT name FROM sqlite_schema")}
        if "fact" not in tables:
            return []
        return [Fact(*row) for row in self._database.execute(
            "SELECT kind, name, value, utc, sha256 FROM fact ORDER BY id")]

    # --- what was published

    def documents(self, kind: Optional[str] = None) -> Iterator[Document]:
        """The lines of the stream that belong to this campaign, in order: estimate, cycle, alarm, ..."""
        for (line,) in self._database.execute("SELECT line FROM document ORDER BY seq"):
            document: Document = json.loads(line)
            if kind is None or document["type"] == kind:
                yield document

    def estimate(self) -> Optional[Document]:
        """The last one; None where there was none."""
        last = None
        for last in self.documents("estimate"):
            pass
        return last

    # --- names

    def _labels(self) -> list[tuple[str, str]]:
        labels = [(name, UNITS.get(name, "")) for name in CHANNELS]
        if self._database.execute("SELECT 1 FROM sqlite_master WHERE name = 'channel'").fetchone():
            for number, name, unit in self._database.execute("SELECT id, name, unit FROM channel"):
                labels[number] = (name, unit)
        return labels

    def _channel(self, name: str) -> int:
        names = [label for label, _ in self._labels()]
        for number, label in enumerate(names):
            if name in (label, CHANNELS[number]):
                return number
        raise KeyError(f"{self.file.name} knows no channel {name!r}; it has: {', '.join(names)}")

    def _run(self, run: Union[str, int]) -> Run:
        for found in self.runs:
            if run in (found.name, found.index):
                return found
        raise KeyError(f"{self.file.name} has no run {run!r}; it has: {', '.join(r.name for r in self.runs)}")


def _doubles(values: array.array) -> Doubles:
    return values if numpy is None else numpy.frombuffer(values, dtype=float) if values else numpy.empty(0)


def _from_blob(blob: bytes) -> Doubles:
    if numpy is not None:
        return numpy.frombuffer(blob, dtype="<f8").astype(float)
    return array.array("d", struct.unpack(f"<{len(blob) // 8}d", blob))
