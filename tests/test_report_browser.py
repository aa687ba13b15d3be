"""report.html in a browser: nothing overflows, nothing is cut, nothing is complained of."""

import re
import shutil
import subprocess

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
PROBE = """<body><script>
const widths = [390, 1440]; let out = [];
for (const w of widths) { const f = document.createElement('iframe');
  f.style.width = w + 'px'; f.style.height = '900px'; f.src = 'report.html';
  f.onload = () => { const d = f.contentDocument.documentElement;
    const cut = [...d.querySelectorAll('svg')].filter(s => { const b = s.getBoundingClientRect();
      return [...s.querySelectorAll('text')].some(t => { const r = t.getBoundingClientRect();
        return r.left < b.left - 1 || r.right > b.right + 1 || r.top < b.top - 1 || r.bottom > b.bottom + 1; }); });
    out.push(w + ':' + (d.scrollWidth - d.clientWidth) + ':' + cut.length); document.title = out.join(' '); };
  document.body.append(f); }
</script></body>"""


@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
def test_in_a_browser_nothing_overflows_no_label_is_cut_and_nothing_is_complained_of(
    example_folder, tmp_path
):
    shutil.copy(example_folder / "report.html", tmp_path)
    (tmp_path / "probe.html").write_text(PROBE)
    command = [
        CHROMIUM,
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-sync",
        "--disable-background-networking",
        "--disable-component-update",
        f"--user-data-dir={tmp_path / 'u'}",
        "--window-size=1600,1000",
        "--allow-file-access-from-files",
        "--enable-logging=stderr",
        "--virtual-time-budget=4000",
        "--dump-dom",
        f"file://{tmp_path / 'probe.html'}",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    title = re.search(r"<title>(.*?)</title>", done.stdout)
    assert title, done.stdout[:500]
    assert sorted(title[1].split()) == ["1440:0:0", "390:0:0"]
    assert "CONSOLE" not in done.stderr
