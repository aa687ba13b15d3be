"""Make the pictures of the README from a results folder.

    seatrial demo --out demo
    python docs/make_pictures.py demo/results [--out docs/pictures] [--all]

The report is taken by Chromium (with ``--all`` also dark, and at the width of a phone); the recording by
Rerun's own viewer without a window (it needs a graphics driver; Mesa's software one will do). What is not
installed is left out, and said so.
"""

from __future__ import annotations

import argparse
import io
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

LARGEST = 300_000
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
#: Name, width, height, dark; the first is that of the README.
PAGES = (("report", 1280, 900, False), ("report-dark", 1280, 900, True), ("report-phone", 390, 844, False))
QUIET = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-sync",
    "--hide-scrollbars",
    "--disable-background-networking",
    "--disable-component-update",
)
#: Pixels at the top of the viewer's window that say only on which machine it ran.
TITLE_BAR = 36


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path, help="folder with report.html and recording.rrd")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "pictures")
    parser.add_argument(
        "--at", type=float, default=None, help="s, where the time line of the recording stands"
    )
    parser.add_argument("--all", action="store_true", help="the report dark and on a phone too")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    made = [
        *report_pictures(chosen.results, chosen.out, PAGES if chosen.all else PAGES[:1]),
        *recording_picture(chosen.results, chosen.out, chosen.at),
    ]
    for path in made:
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")
    return 0 if made else 1


def report_pictures(results: Path, out: Path, pages: tuple) -> list[Path]:
    """One picture of the page per width and scheme."""
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        print("no Chromium on this machine: the report is left out", file=sys.stderr)
        return []
    return [
        picture_of_page(browser, results / "report.html", out / f"{name}.png", *how) for name, *how in pages
    ]


def picture_of_page(browser: str, page: Path, out: Path, width: int, height: int, dark: bool) -> Path:
    """The top of a page; in a frame, because a window cannot be as narrow as a phone."""
    with tempfile.TemporaryDirectory() as folder:
        frame, raw = Path(folder) / "frame.html", Path(folder) / "raw.png"
        style = f"border:0;width:{width}px;height:{height}px;display:block"
        frame.write_text(
            f'<body style="margin:0"><iframe src="{page.resolve().as_uri()}" style="{style}"></iframe></body>'
        )
        command = [browser, *QUIET, f"--user-data-dir={folder}/profile", "--force-device-scale-factor=1.5",
                   f"--window-size={max(width, 500)},{height}", "--allow-file-access-from-files",
                   "--virtual-time-budget=3000", f"--screenshot={raw}", frame.as_uri()]  # fmt: skip
        command[1:1] = ["--blink-settings=preferredColorScheme=0"] if dark else []
        subprocess.run(command, check=True, capture_output=True, timeout=120)
        with Image.open(raw) as image:
            save(image.crop((0, 0, round(width * 1.5), round(height * 1.5))), out)
    return out


def recording_picture(results: Path, out: Path, at: float | None) -> list[Path]:
    """The recording as it opens, with the time line in the middle of the campaign."""
    viewer = shutil.which(
        "rerun", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    )
    if viewer is None:
        print("no Rerun viewer beside this Python: the recording is left out", file=sys.stderr)
        return []
    port = free_port()
    command = [viewer, "--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", "1600x1000",
               "--hide-welcome-screen"]  # fmt: skip
    silent = subprocess.DEVNULL
    with subprocess.Popen(command, stdout=silent, stderr=silent, start_new_session=True) as process:
        try:
            raw = take(f"rerun+http://127.0.0.1:{port}/proxy", results / "recording.rrd", at)
        except (ConnectionError, RuntimeError, TimeoutError) as error:
            print(f"the Rerun viewer did not start ({error}): the recording is left out", file=sys.stderr)
            return []
        finally:
            os.killpg(process.pid, signal.SIGTERM)  # the viewer is a child of the command
    with Image.open(io.BytesIO(raw)) as image:
        save(image.crop((0, TITLE_BAR, image.width, image.height)), out / "recording.png")
    return [out / "recording.png"]


def take(url: str, recording: Path, at: float | None) -> bytes:
    """Open a recording in a running viewer and return a PNG of the window."""
    client = connected(url)
    client.open(str(recording.resolve()))
    elapsed = next(t for r in client.get_state().recordings for t in r.timelines if t.name == "elapsed")
    moment = at if at is not None else (elapsed.start + elapsed.end) / 2e9
    client.set_time(timeline="elapsed", duration=moment, play_state="paused")
    time.sleep(2.0)
    return bytes(client.take_screenshot())


def connected(url: str, patience: float = 20.0):
    """A client, as soon as the viewer answers."""
    import rerun.experimental

    last = time.monotonic() + patience
    while True:
        try:
            return rerun.experimental.ViewerClient(url)
        except ConnectionError:
            if time.monotonic() > last:
                raise
            time.sleep(0.3)


def free_port() -> int:
    """A port of the loopback interface that nobody uses now."""
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return int(s.getsockname()[1])


def save(image: Image.Image, path: Path) -> None:
    """A PNG made smaller until it is small enough: fewer colours first, then fewer pixels."""
    full = image.convert("RGB")
    for scale in (1.0, 0.9, 0.8, 0.7, 0.6, 0.5):
        size = (round(full.width * scale), round(full.height * scale))
        small = full.resize(size, Image.Resampling.LANCZOS) if scale < 1 else full
        for picture in (small, small.quantize(256, Image.Quantize.FASTOCTREE)):
            picture.save(path, optimize=True)
            if path.stat().st_size <= LARGEST:
                return


if __name__ == "__main__":
    raise SystemExit(main())
