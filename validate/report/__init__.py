"""What a run found out, for programs (report.json, model.json) and for people (report.html)."""

from validate.report.contents import report_of
from validate.report.model_file import model_schema, read_model, write_model
from validate.report.schema import ModelFile, Report, report_schema

__all__ = ["ModelFile", "Report", "model_schema", "read_model", "report_of", "report_schema", "write_model"]
