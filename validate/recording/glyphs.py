"""Text that the viewer can draw: where its fonts lack a character, Rerun 0.41 ends instead of leaving it out."""

from __future__ import annotations

import re

#: Ranges that both of its fonts have, tried one by one: Latin, Greek, Cyrillic.
RANGES = (
    (0x20, 0x7E),
    (0xA1, 0xAC),
    (0xAE, 0x148),
    (0x14A, 0x17F),
    (0x391, 0x3A1),
    (0x3A3, 0x3CE),
    (0x410, 0x44F),
)
#: And what else; the superscript minus is missing in the font for code alone.
SINGLES = frozenset("\nЁёẋẏṙḟȧ\u0302\u0307\u0308\u20db–—…′“”‘’„•⁰⁴⁵⁶⁷⁸⁹⁻₀₁₂₃₄₅→∏−√∫≤≥≈≠∞∆‰€✓")
#: In place of a character that neither font has.
UNKNOWN = "?"
_CODE = re.compile(r"`[^`\n]*`")
_POWER = re.compile(r"·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
_PLAIN = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def drawable(text: str) -> str:
    """The same text, every character of which the viewer has; powers of ten in code as ``e-5``."""
    plain = _CODE.sub(lambda found: _in_code(found[0]), text)
    return "".join(c if _known(c) else UNKNOWN for c in plain)


def _in_code(text: str) -> str:
    return _POWER.sub(lambda found: "e" + found[1].translate(_PLAIN), text).replace("⁻", "-")


def _known(character: str) -> bool:
    return character in SINGLES or any(low <= ord(character) <= high for low, high in RANGES)
