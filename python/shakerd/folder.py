"""A campaign's folder, read: campaign.json and a CSV file for each run (docs/cli_diagnose.md)."""
from __future__ import annotations

import array
import csv
import dataclasses
import json
import pathlib
import re
from typing import Any, Optional

from .campaign import Document, Doubles, NotACampaign, PathLike, _doubles

CHANNELS = ("t", "displacement", "excitation", "acceleration", "force")
COMMENT = re.compile(r'("(?:\\.|[^"\\])*")|//[^\n]*|/\*.*?\*/', re.DOTALL)


@dataclasses.dataclass(frozen=True)
class Recording:
    """One run. `columns`: by channel, of equal length; `units`: as the folder states them, by channel."""
    name: str
    kind: str  # periodic, imposed_motion or transient
    frequency_hz: Optional[float]
    amplitude: Optional[float]
    columns: dict[str, Doubles]
    units: dict[str, str]


class CampaignFolder:
    """A recorded campaign: `name`, and `runs` in the order of the file. Reads; never writes."""

    def __init__(self, folder: PathLike) -> None:
        self.folder = pathlib.Path(folder)
        file = self.folder / "campaign.json"
        if not file.is_file():
            raise FileNotFoundError(f"{file}: there is no such file")
        try:
            self.document: Document = json.loads(COMMENT.sub(lambda m: m.group(1) or "", file.read_text("utf-8")))
            self.name: str = self.document.get("name", self.folder.resolve().name)
            self.runs = [self._run(entry) for entry in self.document["runs"]]
        except (ValueError, KeyError, TypeError, AttributeError) as trouble:
            raise NotACampaign(f"{file}: is no campaign that was recorded: {trouble!r}") from trouble

    def __repr__(self) -> str:
        return f"<CampaignFolder {self.name!r}, {len(self.runs)} runs>"

    def __getitem__(self, run: str) -> Recording:
        for found in self.runs:
            if found.name == run:
                return found
        raise KeyError(f"{self.folder} has no run {run!r}; it has: {', '.join(r.name for r in self.runs)}")

    def _run(self, entry: dict[str, Any]) -> Recording:
        names = {channel: self.document.get("columns", {}).get(channel, channel) for channel in CHANNELS}
        stated = self.document.get("units", {})
        columns: dict[str, array.array[float]] = {}
        units: dict[str, str] = {}
        with open(self.folder / entry.get("file", f"{entry['name']}.csv"), newline="", encoding="utf-8-sig") as text:
            rows = csv.reader(text)
            header = [re.fullmatch(r"\s*(.*?)\s*(?:[\[(](.*)[\])])?\s*", cell) for cell in next(rows)]
            index = {}
            for channel, name in names.items():
                for at, cell in enumerate(header):
                    if cell is not None and name in (cell.group(0).strip(), cell.group(1)):
                        index[channel] = at
                        unit = cell.group(2) or stated.get("time" if channel == "t" else channel, "")
                        units[channel] = unit if isinstance(unit, str) else unit["label"]
            columns = {channel: array.array("d") for channel in index}
            for row in rows:
                for channel, at in index.items():
                    if row:
                        columns[channel].append(float(row[at]))
        return Recording(entry["name"], entry.get("kind", "periodic"), entry.get("frequency_hz"),
                         entry.get("amplitude"), {c: _doubles(v) for c, v in columns.items()}, units)


def open_folder(folder: PathLike) -> CampaignFolder:
    """Raises FileNotFoundError, or NotACampaign with the reason."""
    return CampaignFolder(folder)
