"""model.json: written, read back, refused."""

import json
import math
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from identify.fit import FittedEffect
from validate.report import model_schema, read_model, write_model
from validate.report.model_file import ModelFileError


def test_a_model_comes_back_as_it_was(example, tmp_path):
    fitted = FittedEffect(
        "actuator_deadband", "rudder", example.after.effects[0].parameters, {"form": "play"}
    )
    fit = replace(example.after, effects=(fitted,))
    write_model(fit, tmp_path / "model.json", {"campaign": "c.toml"})
    back = read_model(tmp_path / "model.json")
    np.testing.assert_array_equal(back.covariance, fit.covariance)
    assert replace(back, covariance=fit.covariance) == fit
    model = json.loads((tmp_path / "model.json").read_text())
    jsonschema.Draft202012Validator(model_schema()).validate(model)
    assert list(model) == [
        "schema",
        "model",
        "vessel",
        "inputs",
        "parameters",
        "covariance",
        "effects",
        "provenance",
    ]
    assert model["provenance"]["campaign"] == "c.toml"


def test_what_is_not_known_of_a_model_stays_not_known(example, tmp_path):
    covariance = example.after.covariance.copy()
    covariance[1] = np.nan
    first, second, *others = example.after.coefficients
    coefficients = (first, replace(second, stderr=math.nan), *others)
    fit = replace(example.after, covariance=covariance, coefficients=coefficients, chi2_per_dof=math.nan)
    write_model(fit, tmp_path / "model.json")
    back = read_model(tmp_path / "model.json")
    np.testing.assert_array_equal(back.covariance, covariance)
    assert math.isnan(back.coefficients[1].stderr)
    assert math.isnan(back.chi2_per_dof)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "cannot be read"),
        ("{", "is not JSON"),
        ('{"schema": "seatrial.report/1"}', "schema"),
        ("[]", "file"),
    ],
)
def test_a_file_that_is_no_model_is_refused_by_name(tmp_path, content, says):
    path = tmp_path / "x.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(ModelFileError, match=says) as caught:
        read_model(path)
    assert str(path) in str(caught.value)
    assert caught.value.exit_status == 2
