"""What nmea2000 decodes, beside our tables."""

import numpy as np


def peer_value(field) -> object:
    """A field's value as the peer has it: NaN where it has none, codes of lookups, raw times."""
    kind = field.type.name
    if kind in ("LOOKUP", "INDIRECT_LOOKUP", "BITLOOKUP"):
        return field.raw_value
    if kind.startswith("STRING"):
        return field.value or ""
    return np.nan if field.value is None else field.raw_value


def differences(table, row, peer) -> list[tuple[str, object, object]]:
    """Fields in which a row is not what the peer decoded."""
    out = []
    for field in peer.fields:
        name = "source_" if field.id == "source" else field.id
        if name not in table.columns or isinstance(field.value, list):
            continue
        ours, theirs = table[name].iloc[row], peer_value(field)
        missing_code = isinstance(ours, float) and ours != ours and field.value is None
        same = ours == theirs or (ours != ours and (theirs is None or theirs != theirs)) or missing_code
        if not same and field.type.name not in ("PGN", "FLOAT"):
            out.append((field.id, ours, theirs))
    return out
