"""The work on one robot, where it is done: fit, convert, prove, write, report. Nothing that goes wrong leaves it."""

from __future__ import annotations

import gc
import hashlib
import json
import tempfile
import time
import traceback
from collections.abc import Iterator, Mapping
from contextlib import chdir, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from uuid import uuid4

from respot.calibration.calibration import Calibration
from respot.calibration.final_model import precise
from respot.calibration.report import report
from respot.calibration.source_fit import FitOptions, SourceFit, fit_source
from respot.correction.conversion import Conversion, convert, record_of
from respot.correction.proof import VerifyError
from respot.figures.fit_page import fit_page
from respot.issues import BadInputError, Issue
from respot.languages.overlay import check_overlay
from respot.line.findings import effects_of, fit_figures, identity
from respot.line.jobs import Job, JobResult, inputs_changed
from respot.line.settings import correction_options, fit_options, tolerance_of
from respot.output import rehearse, write_backup

#: What a robot's folder holds: the backup corrected, the page of its fit, its calibration.
PROGRAMS, PAGE, CALIBRATION = "programs", "fit.html", "calibration.json"
#: New objects after which Python looks for garbage: what is read is none.
_GARBAGE = 1_000_000


def do_job(job: Job, staging: str | None, sent: Mapping[str, bytes] | None = None) -> JobResult:
    """Do the work on one robot.

    Parameters
    ----------
    job : Job
        What to do.
    staging : str or None
        Begin of the path of a new folder for what is written; None where nothing is to be written. Each attempt has a
        folder of its own: of a worker that was lost nobody knows how far it came, or whether it still writes.
    sent : mapping of str to bytes, optional
        The inputs, where their paths mean nothing here; what is written is returned instead.
    """
    started = time.process_time()
    with _few_collections():
        if sent is None:
            place = None if staging is None else Path(f"{staging}.{uuid4().hex}")
            result = replace(_guarded(job, place), made="" if place is None else place.name)
        else:
            result = _elsewhere(job, staging is not None, sent)
    return _with_time(result, time.process_time() - started)


def _elsewhere(job: Job, write: bool, sent: Mapping[str, bytes]) -> JobResult:
    """Do the work on inputs that were sent, in a folder of its own."""
    with tempfile.TemporaryDirectory(prefix="respot-", ignore_cleanup_errors=True) as folder:
        line, out = Path(folder, "line"), Path(folder, "out")
        for path, data in sent.items():
            place = line / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(data)
        line.mkdir(exist_ok=True)
        here = Job(job.robot, str(line), job.inputs, job.input_hash, job.option_hash)
        result = _guarded(here, out if write else None)
        files = {path: (out / path).read_bytes() for path in result.outputs}
        return JobResult(**{**vars(result), "files": files})


def _guarded(job: Job, out: Path | None) -> JobResult:
    """Turn every way the work can end into a result."""
    try:
        with chdir(job.folder):
            result = _work(job, out)
        # numbers that are none would stop the summary of all robots, long after this one is done
        json.dumps([result.figures, result.effects, result.edits], allow_nan=False)
        if inputs_changed(job):
            message = "a file changed while it was read: run again when nobody writes to it"
            return JobResult(job.name, "failed", "SOURCE_CHANGED", message)
        return result
    except MemoryError as error:
        return _out_of_memory(job, error)
    except BadInputError as error:
        if isinstance(error.__cause__, MemoryError):
            return _out_of_memory(job, error)
        return JobResult(job.name, "failed", error.issue.code, _words(error.issue))
    except OSError as error:
        return JobResult(job.name, "failed", "CANNOT_WRITE", f"its folder cannot be written: {error.strerror}")
    except VerifyError as error:
        return JobResult(job.name, "failed", "VERIFY_FAILED", f"nothing was written: {error}")
    except Exception as error:
        message = f"{type(error).__name__}: {error}; please report it"
        return JobResult(job.name, "failed", "INTERNAL_FAULT", message, traceback.format_exc())


def _out_of_memory(job: Job, error: BaseException) -> JobResult:
    details = "".join(traceback.format_exception(error))
    message = "needs more memory than it may have: raise --memory, or look what its backup holds"
    return JobResult(job.name, "failed", "OUT_OF_MEMORY", message, details)


def _work(job: Job, out: Path | None) -> JobResult:
    robot, options = job.robot, job.robot.options
    correction = correction_options(options)
    if correction.templates is not None:
        check_overlay(correction.templates)
    reference = None if robot.reference is None else Path(robot.reference)
    calibration = None if robot.calibration is None else Path(robot.calibration)
    fitting = fit_options(robot.kind or "theory", options)
    try:
        conversion = convert(Path(robot.source), reference, calibration, fitting, correction)
    except BadInputError as error:
        fitted = _nothing_to_write(error, job, reference, fitting)
        if fitted is None:
            raise
        return _fitted(job, fitted, fitting, out)
    return _converted(job, conversion, out)


def _nothing_to_write(error: BadInputError, job: Job, reference: Path | None, fitting: FitOptions) -> SourceFit | None:
    """Return the fit of a measured robot that needs no correction, where this is why it was not converted.

    In a free frame the rigid part is the place of the tracker: without effects nothing is left to compensate. To a
    person who asks for programs that is an error; of a robot of a line it is good news.
    """
    possible = error.issue.code == "BAD_OPTION" and fitting.kind == "measured" and fitting.frame != "same"
    if not possible or reference is None or job.robot.options.get("inverse"):
        return None
    fitted = fit_source(Path(job.robot.source), reference, fitting)
    model = fitted.fit.calibration
    return None if model.terms or model.tool_offset is not None else fitted


#: Why no program of a measured robot is written. The rigid part is the tracker's own place and nobody's error.
_LOOKED = "no effect was found that programs could make good: they stay as they are"
_NOT_ALL_LOOKED = "none of the effects that were looked for was found: the programs stay as they are"


def _fitted(job: Job, fitted: SourceFit, fitting: FitOptions, out: Path | None) -> JobResult:
    record = report(fitted.fit)
    record["calibration_hash"] = fitted.fit.calibration.content_hash
    figures = {
        **identity(fitted.source.robot),
        **fit_figures(record),
        "programs": False,
        "edits": 0,
        "refused": [],
        "note": _LOOKED if fitting.effects == "auto" else _NOT_ALL_LOOKED,
    }
    model = precise(fitted.fit)
    if out is not None:
        out.mkdir()
        _write_fit(job, fitted, model, record, out)
    return JobResult(job.name, "done", figures=figures, effects=effects_of(record, model), outputs=_manifest(out))


def _converted(job: Job, conversion: Conversion, out: Path | None) -> JobResult:
    record = record_of(conversion)
    fit = record.get("fit")
    figures = {
        **identity(conversion.robot),
        **({} if fit is None else fit_figures(fit)),
        "programs": True,
        "direction": record["direction"],
        "edits": len(record["edits"]),
        "refused": sorted({f"{item['program']}: {item['code']}" for item in record["refused"]}),
    }
    if record.get("effects_not_written"):
        figures["note"] = f"not written, for a person to put right: {', '.join(record['effects_not_written'])}"
    model = None if conversion.fitted is None else precise(conversion.fitted.fit)
    templates = correction_options(job.robot.options).templates
    if out is None or templates is not None:  # a plant's template is proved before anything is written
        rehearse(conversion.files, conversion.correction, templates)
    if out is not None:
        out.mkdir()
        write_backup(out / PROGRAMS, conversion.files, conversion.correction, record)
        if conversion.fitted is not None and model is not None and fit is not None:
            fit["calibration_hash"] = conversion.calibration.content_hash
            _write_fit(job, conversion.fitted, model, fit, out)
    return JobResult(
        job.name,
        "done",
        figures=figures,
        effects=effects_of(fit or {}, model, record.get("effects_written", ())),
        edits=[{key: item[key] for key in _EDIT} for item in record["edits"]],
        outputs=_manifest(out),
    )


#: What the ledger keeps of an edit.
_EDIT = ("path", "line", "target", "depth", "shift_mm", "turn_deg")


def _write_fit(job: Job, fitted: SourceFit, model: Calibration, record: Mapping[str, Any], out: Path) -> None:
    """Write the page, and the calibration where its orientations are read as they are written."""
    page = fit_page(
        record,
        title=f"{job.name}: {fitted.source.robot.name if fitted.source.robot is not None else job.robot.source}",
        source=job.robot.source,
        reference=str(job.robot.reference),
        tolerance=tolerance_of(job.robot.options),
        issues=[issue.as_json() for issue in fitted.issues],
    )
    _write(out / PAGE, page)
    if not fitted.fit.rereads_source:
        _write(out / CALIBRATION, model.to_json())


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise BadInputError("CANNOT_WRITE", f"cannot be written: {error.strerror}", path.name) from error


def _manifest(out: Path | None) -> dict[str, tuple[str, int]]:
    """Hash and size of every file of a folder, by path."""
    if out is None:
        return {}
    files = sorted(path for path in out.rglob("*") if path.is_file())
    contents = ((path.relative_to(out).as_posix(), path.read_bytes()) for path in files)
    return {path: (hashlib.sha256(data).hexdigest(), len(data)) for path, data in contents}


def _words(issue: Issue) -> str:
    place = ":".join(str(part) for part in (issue.path, issue.line) if part is not None)
    return f"{place}: {issue.message}" if place else issue.message


def _with_time(result: JobResult, seconds: float) -> JobResult:
    return JobResult(**{**vars(result), "cpu_seconds": seconds})


@contextmanager
def _few_collections() -> Iterator[None]:
    before = gc.get_threshold()
    gc.set_threshold(_GARBAGE)
    try:
        yield
    finally:
        gc.set_threshold(*before)
        gc.collect()
