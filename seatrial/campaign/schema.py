"""The JSON schema of ``campaign.toml``."""

from __future__ import annotations

from typing import Any

from seatrial.campaign.tables import CampaignTable
from seatrial.names import ESTIMATORS, MODELS, OPTIMISERS


def campaign_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of the campaign file, for editors that complete and check TOML."""
    schema = CampaignTable.model_json_schema()
    names = schema["$defs"]["ModelTable"]["properties"]
    for key, known in (("name", MODELS), ("estimator", ESTIMATORS), ("optimiser", OPTIMISERS)):
        names[key]["enum"] = list(known)
    header = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "seatrial.campaign/1",
        "title": "campaign.toml",
    }
    return {**schema, **header}
