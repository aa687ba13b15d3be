"""How the site is built: ``make docs``."""

from importlib import metadata

project = "Seatrial"
author = "the Seatrial authors"
release = metadata.version("seatrial")
extensions = ["myst_parser"]
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "Seatrial"
html_static_path: list[str] = []
html_show_sphinx = False
exclude_patterns = ["site"]
suppress_warnings = ["myst.strikethrough"]
