"""Estimates and diagnoses by `shakerctl`, whose JSON documents are returned."""
from __future__ import annotations

import json
import os
import pathlib
import shutil
import subprocess
import tempfile
from typing import Any, Mapping, Optional, Union

Document = dict[str, Any]
PathLike = Union[str, "os.PathLike[str]"]
NOT_USABLE = 5  # shakerctl's status: the document is there, and says what is wrong


class ToolFailed(RuntimeError):
    """shakerctl could not do it. `status` is its exit status; the text is its sentence."""

    def __init__(self, status: int, sentence: str) -> None:
        super().__init__(sentence)
        self.status = status


def shakerctl() -> str:
    """The program: $SHAKERCTL, else the one in the path."""
    found = os.environ.get("SHAKERCTL") or shutil.which("shakerctl")
    if not found:
        raise FileNotFoundError("shakerctl is not in the path; install shakerd, or set SHAKERCTL")
    return found


def estimate(data: PathLike, *options: str, model: Optional[Union[PathLike, Mapping[str, Any]]] = None) -> Document:
    """As `shakerctl estimate DATA --json`: of a campaign's database or folder, or of a CSV file with its options.

    A folder without `model` is estimated with the model.json in it, if there is one.
    """
    return _called("estimate", data, options, model or _own_model(data))


def diagnose(data: PathLike, *options: str, model: Optional[Union[PathLike, Mapping[str, Any]]] = None) -> Document:
    """As `shakerctl diagnose DATA --json`: what the model lacks. Without `model`, a database's or a folder's own."""
    return _called("diagnose", data, options, model or _own_model(data))


def import_campaign(source: PathLike, folder: PathLike, *options: str) -> Document:
    """As `shakerctl import SOURCE --out FOLDER --json`: of CSV, MAT or UFF files. `folder` must be new or empty.

    For example `import_campaign("day.mat", "day", "--frequency", "2,4", "--unit", "displacement=mm")`.
    """
    return _called("import", source, ("--out", os.fspath(folder), *options), None)


def _own_model(data: PathLike) -> Optional[PathLike]:
    model = pathlib.Path(data) / "model.json"
    return model if model.is_file() else None


def _called(command: str, data: PathLike, options: tuple[str, ...],
            model: Optional[Union[PathLike, Mapping[str, Any]]]) -> Document:
    words = [shakerctl(), command, os.fspath(data), "--json", *options]
    with tempfile.TemporaryDirectory(prefix="shakerd.") as folder:
        if isinstance(model, Mapping):
            file = pathlib.Path(folder) / "model.json"
            file.write_text(json.dumps(model), encoding="utf-8")
            words += ["--model", str(file)]
        elif model is not None:
            words += ["--model", os.fspath(model)]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
    try:
        document: Document = json.loads(done.stdout)
    except ValueError:
        raise ToolFailed(done.returncode, done.stderr.strip() or f"{command} said nothing") from None
    if done.returncode not in (0, NOT_USABLE) and "error" in document:
        raise ToolFailed(done.returncode, str(document["error"]))
    return document
