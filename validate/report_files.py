"""The results folder: every file that a run leaves behind."""

from __future__ import annotations

from pathlib import Path

from preprocess.storage import write_folder
from validate.diagnosis import Results
from validate.report.contents import report_of
from validate.report.model_file import write_model
from validate.report.names import file_names
from validate.report.schema import to_json
from validate.report.tables import write_predictions
from validate.report.units import with_input_units


def write_results(results: Results, folder: Path) -> dict[str, Path]:
    """Write everything that a run found out.

    Parameters
    ----------
    results : Results
        What a run found out.
    folder : Path
        The results folder; made where it is not there, files of the same name are replaced.

    Returns
    -------
    dict of str to Path
        ``report.json``, ``report.html``, ``model.json``, ``recording.rrd``, ``predictions`` and ``trial``.
    """
    from validate.recording import write_recording
    from validate.report.page import report_page

    results = with_input_units(results)
    names = ("report.json", "report.html", "model.json", "recording.rrd", "predictions", "trial")
    paths = {name: folder / name for name in names}
    folder.mkdir(parents=True, exist_ok=True)
    files = file_names([*results.predictions, *(t.name for t in results.trials)])
    fit = results.after
    facts = {"model": fit.model, "estimator": fit.estimator, "optimiser": fit.optimiser, "digest": fit.digest}
    write_folder(results.trials, paths["trial"], files)
    write_predictions(results.predictions, fit.inputs, paths["predictions"], files, facts)
    write_model(fit, paths["model.json"], {"campaign": results.campaign, "equations": results.equations})
    paths["report.json"].write_text(to_json(report_of(results)), encoding="utf-8")
    paths["report.html"].write_text(report_page(results), encoding="utf-8")
    write_recording(results, paths["recording.rrd"])
    return paths
