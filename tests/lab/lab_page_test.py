#!/usr/bin/env python3
"""retrace lab end to end: JSON, Markdown, plots, and the page in a real browser.

lab_page_test.py RETRACE [SCREENSHOT.png]

Runs the lab on a small scene and an animated file, checks what it says, then opens the page in headless Chromium with a script that clicks:
the table must be sorted by the column clicked, the filter must filter, and the heat maps must flip. Exit code 77 (skipped) if there is
no Chromium; everything before that is checked all the same."""
import json
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

CLICKS = """
<script>
const cells = name => { const i = [...document.querySelectorAll("#table th")].findIndex(t => t.dataset.column === name);
  return [...document.querySelectorAll("#table tbody tr")].map(r => parseFloat(r.cells[i].textContent)); };
const result = { errors: [] };
addEventListener("error", e => result.errors.push(e.message));
const click = name => document.querySelector(`th[data-column="${name}"]`).click();
click("tests"); result.up = cells("tests"); result.mark = document.querySelector('th[data-column="tests"]').getAttribute("aria-sort");
click("tests"); result.down = cells("tests");
click("bytes"); result.bytes = cells("bytes");
result.rows = document.querySelectorAll("#table tbody tr").length;
document.getElementById("find").value = "kd-tree horn"; document.getElementById("find").oninput();
result.filtered = [...document.querySelectorAll("#table tbody tr")].map(r => r.cells[1].textContent);
document.getElementById("find").value = ""; document.getElementById("mailboxes").checked = true; document.getElementById("mailboxes").oninput();
result.all = document.querySelectorAll("#table tbody tr").length;
const map = () => [document.getElementById("map").src.length, document.getElementById("map").src.slice(0, 22), document.getElementById("caption").textContent];
const first = map(); document.getElementById("next").click(); result.flip = [first, map()];
result.plots = document.querySelectorAll("#plots svg").length;
document.getElementById("scene").value = 1; document.getElementById("scene").onchange();
result.frames = document.querySelectorAll("#frames tr").length; result.hidden = document.getElementById("animation").hidden;
const out = document.createElement("pre"); out.id = "clicked"; out.textContent = JSON.stringify(result); document.body.append(out);
</script>
"""


def check(condition, message):
    if not condition:
        sys.exit(f"lab_page_test: {message}")


def main():
    retrace = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        subprocess.run([retrace, "make-scene", "creatures", "--set", "detail=2", "-o", folder / "creatures.glb"], check=True,
                       stdout=subprocess.DEVNULL)
        scenes = ["knot:along=40,around=12", str(folder / "creatures.glb")]
        page, tables = folder / "lab.html", folder / "lab.md"
        tables.write_text("# Mine\n\n<!-- retrace lab: begin -->\nold\n<!-- retrace lab: end -->\n\nThe end.\n")
        run = subprocess.run([retrace, "lab", *scenes, "--size", "48x36", "--frames", "2", "--json", "--html", page, "--markdown", tables,
                              "--plots", folder / "plots", "--quiet"], check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        check(run.stderr == b"", f"--quiet printed: {run.stderr!r}")
        report = json.loads(run.stdout)
        check(report["differences"] == 0, "structures differ")
        check([s["name"] for s in report["scenes"]][1] == "creatures", "scene names")
        for scene in report["scenes"]:
            for kind, checked in scene["brute_force"].items():
                check(checked["rays"] > 0 and checked["wrong"] == 0, f"brute force on {kind} rays: {checked}")
            for row in scene["structures"]:
                check(row["rays"]["primary"]["hits"] > 0, f"{row['key']} hits nothing")
        check(report["scenes"][0]["animation"] is None, "a knot does not move")
        frames = report["scenes"][1]["animation"]["frames"]
        check(len(frames) == 2 and all(f["different"] == 0 and f["hits"] > 0 for f in frames), f"frames: {frames}")

        text = tables.read_text()
        check(text.startswith("# Mine\n") and text.endswith("The end.\n") and "old" not in text, "Markdown around the tables changed")
        for line in text.splitlines():
            check(not line.startswith("|") or line.endswith("|"), f"broken table line: {line}")
        plots = sorted((folder / "plots").glob("*.svg"))
        check(len(plots) == 12, f"{len(plots)} plots")
        for plot in plots:
            ElementTree.parse(plot)

        html = page.read_text()
        check(not re.search(r'(src|href)="https?:', html), "the page needs the network")
        browser = next((b for b in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if b), None)
        if not browser:
            print("lab_page_test: no Chromium, the page was not opened")
            return 77
        (folder / "clicked.html").write_text(html.replace("</body>", CLICKS + "</body>"))
        command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--user-data-dir={folder / 'profile'}"]
        dom = subprocess.run([*command, "--dump-dom", (folder / "clicked.html").as_uri()], check=True, stdout=subprocess.PIPE,
                             stderr=subprocess.DEVNULL, timeout=120).stdout.decode()
        found = re.search(r'<pre id="clicked">(.*?)</pre>', dom, re.S)
        check(found, "the page's script did not run to its end")
        result = json.loads(found.group(1).replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">"))
        check(result["errors"] == [], f"errors in the page: {result['errors']}")
        check(len(result["up"]) > 20 and result["up"] == sorted(result["up"]) and result["mark"] == "ascending", "first click does not sort upwards")
        check(result["down"] == sorted(result["up"], reverse=True), "second click does not sort downwards")
        check(result["bytes"] == sorted(result["bytes"]), "another column does not sort")
        check(result["filtered"] and all(t.startswith("short stack") for t in result["filtered"]), f"filter: {result['filtered']}")
        check(result["all"] > result["rows"], "mailboxes are not shown")
        (a, b) = result["flip"]
        check(a[1] == b[1] == "data:image/png;base64," and a[0] > 200 and a[2] != b[2], f"heat maps do not flip: {result['flip']}")
        check(result["plots"] == 6, f"{result['plots']} plots on the page")
        check(result["frames"] == 2 and result["hidden"] is False, "the animation is not shown")
        picture = pathlib.Path(sys.argv[2]).resolve() if len(sys.argv) > 2 else folder / "page.png"
        subprocess.run([*command, "--window-size=1400,2600", f"--screenshot={picture}", page.as_uri()], check=True,
                       stderr=subprocess.DEVNULL, timeout=120)
        png = picture.read_bytes()
        check(png[:8] == b"\x89PNG\r\n\x1a\n" and struct.unpack(">II", png[16:24]) == (1400, 2600), "the screenshot is not a picture of the window")
        # An empty page compresses to a few thousand bytes; heat map, table and plots do not.
        check(len(png) > 60000, f"the screenshot holds next to nothing: {len(png)} bytes")
        print(f"lab_page_test: {result['rows']} rows sorted, filtered and flipped in {pathlib.Path(browser).name}; a screenshot of {len(png)} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
