"""Write the reference from the code: commands, campaign keys, formats, models, effects, signals, errors, schemas.

    python docs/generate.py [--out docs/reference]

Nothing here is written twice: every sentence stands in the declaration that it describes.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from reference_methods import effects, formats, methods, models, signals
from reference_program import campaign, commands, errors, files, schemas

REFERENCE = Path(__file__).parent / "reference"


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=REFERENCE)
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)
    for name, write in PAGES.items():
        (out / f"{name}.md").write_text("\n".join(write()).rstrip() + "\n", encoding="utf-8")
    for name, schema in schemas().items():
        text = json.dumps(schema, indent=2, ensure_ascii=False)
        (out / f"{name}.schema.json").write_text(text + "\n", encoding="utf-8")
    return 0


PAGES: dict[str, Callable[[], list[str]]] = {
    "commands": commands,
    "campaign": campaign,
    "formats": formats,
    "models": models,
    "methods": methods,
    "effects": effects,
    "signals": signals,
    "files": files,
    "errors": errors,
}

if __name__ == "__main__":
    sys.exit(main())
