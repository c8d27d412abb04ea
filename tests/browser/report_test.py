"""Makes a report page of a planned job and opens it in headless Chromium: it must draw, and ask for nothing from outside."""
import os
import re
import subprocess
import sys
import tempfile

bin_dir, config = sys.argv[1:3]
with tempfile.TemporaryDirectory() as folder:
    page = os.path.join(folder, "page.html")
    subprocess.run([os.path.join(bin_dir, "weldcell"), "plan", os.path.join(config, "jobs/demo-ladder.yaml"),
                    "--cell", os.path.join(config, "cell-demo.yaml"), "--report", page], check=True)
    with open(page, encoding="utf-8") as f:
        text = f.read()
    outside = re.findall(r"""(?:src|href)\s*=\s*["'](?!#|data:)([^"']+)""", text)
    assert not outside, f"the page refers to {outside}"
    assert "<script" not in text.lower()
    common = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
              "--disable-background-networking", "--disable-component-update", "--disable-sync",
              f"--user-data-dir={os.path.join(folder, 'profile')}"]
    picture = os.path.join(folder, "page.png")
    subprocess.run([*common, f"--screenshot={picture}", "--window-size=1200,2400", f"file://{page}"], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=120)
    colours = subprocess.run(["identify", "-format", "%k %w %h", picture], check=True, capture_output=True, text=True).stdout.split()
    assert int(colours[0]) > 30 and colours[1:] == ["1200", "2400"], f"the picture has {colours}"
    dom = subprocess.run([*common, "--dump-dom", f"file://{page}"], check=True, capture_output=True, text=True, timeout=120).stdout
    assert dom.count("<svg") >= 2 and "demo-ladder" in dom, "the page's drawings are missing"
print("report page: drawn, self-contained")
