"""The report of a diagnosis and the page of a plan in a real browser, Debian's Chromium."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

BROWSER = shutil.which("chromium")
SHAKERCTL, OLEOSIM = os.environ["SHAKERCTL"], os.environ["OLEOSIM"]
SOURCE = pathlib.Path(os.environ["SHAKER_SOURCE"])

# Put into a copy of the page: what the browser made of it, written where --dump-dom shows it.
PROBE = """<script>
const trouble = [];
addEventListener("error", e => trouble.push(String(e.message || e.target.src)), true);
addEventListener("load", () => {
  document.querySelectorAll("details").forEach(d => d.open = true);
  const size = s => { const b = s.getBoundingClientRect(); return [b.width, b.height]; };
  const inside = s => [...s.querySelectorAll("text")].every(t => {
    const a = t.getBoundingClientRect(), b = s.getBoundingClientRect();
    return a.left >= b.left - 2 && a.right <= b.right + 2 && a.top >= b.top - 2 && a.bottom <= b.bottom + 2; });
  const drawn = s => [...s.querySelectorAll("path,rect,circle")].some(e => e.getBoundingClientRect().width > 5);
  const pictures = [...document.querySelectorAll("svg")];
  const found = {trouble, sizes: pictures.map(size), inside: pictures.map(inside), drawn: pictures.map(drawn),
    requests: performance.getEntriesByType("resource").map(r => r.name),
    wide: document.documentElement.scrollWidth - innerWidth, words: document.body.innerText};
  const out = document.createElement("script");
  out.type = "application/json"; out.id = "found";
  out.textContent = JSON.stringify(found).replaceAll("<", "\\\\u003c");
  document.body.append(out);
});
</script>"""


@unittest.skipUnless(BROWSER, "there is no chromium: the report is not looked at in a browser")
class Report(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        subprocess.run([OLEOSIM, "--param", "coulomb_friction=0.3", "--record", cls.folder / "campaign",
                        "--run", "2:3", "--run", "3:3", "--held-out", "4:5"],
                       check=True, capture_output=True, timeout=60)
        subprocess.run([SHAKERCTL, "diagnose", cls.folder / "campaign", "--model",
                        SOURCE / "config/examples/model-oleo.json", "--out", cls.folder / "out"],
                       check=True, capture_output=True, timeout=60)
        cls.page = (cls.folder / "out" / "report.html").read_text()

    def browse(self, *words, page):
        return subprocess.run(
            [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--window-size=1240,1600",
             "--disable-background-networking", f"--user-data-dir={self.folder / 'profile'}",
             "--enable-logging=stderr", *words, page.as_uri()],
            capture_output=True, text=True, timeout=60, env=dict(os.environ, HOME=str(self.folder)))

    def assert_is_drawn(self, page, least_pictures):
        """Every picture is drawn and nothing is fetched. Returns the words that one reads."""
        probed = self.folder / "probed.html"
        probed.write_text(page.replace("</head>", PROBE + "</head>", 1) if "</head>" in page else PROBE + page)
        shown = self.browse("--dump-dom", page=probed)
        match = re.search(r'<script type="application/json" id="found">(.*?)</script>', shown.stdout, re.S)
        self.assertTrue(match, shown.stderr[-2000:])
        found = json.loads(match.group(1))
        self.assertEqual(found["trouble"], [])
        self.assertNotIn("CONSOLE", shown.stderr)
        self.assertEqual(found["requests"], [])
        self.assertEqual(len(found["sizes"]), page.count("<svg"))
        self.assertGreaterEqual(len(found["sizes"]), least_pictures)
        for width, height in found["sizes"]:
            self.assertGreater(min(width, height), 100)
        self.assertTrue(all(found["drawn"]), found["drawn"])
        self.assertTrue(all(found["inside"]), found["inside"])  # no label is cut off
        self.assertLessEqual(found["wide"], 0)  # nothing to scroll sideways for
        self.assertNotRegex(found["words"], r"\bnan\b|\binf\b|undefined")
        return found["words"]

    def test_every_picture_of_a_diagnosis_is_drawn(self):
        self.assertIn("friction", self.assert_is_drawn(self.page, 8))

    def test_every_picture_of_a_plan_is_drawn(self):
        plan = self.folder / "plan.html"
        examples = SOURCE / "config" / "examples"
        subprocess.run([SHAKERCTL, "plan", examples / "model-oleo.json", "--rig", examples / "rig-simulated.json",
                        "--draw", plan], check=True, capture_output=True, timeout=60)
        self.assertIn("The best sets of runs", self.assert_is_drawn(plan.read_text(), 2))

    def test_every_picture_of_a_dossier_is_drawn(self):
        dossier = self.folder / "dossier.html"
        subprocess.run([SHAKERCTL, "report", self.folder / "campaign", "--model",
                        SOURCE / "config/examples/model-oleo.json", "--sink-speed", "3", "--mass", "400",
                        "--limit", "peak_load=60kN", "--piston-area", "0.004", "--out", dossier],
                       check=True, capture_output=True, timeout=60)
        words = self.assert_is_drawn(dossier.read_text(), 13)
        self.assertIn("What this page does not say", words)
        self.assertIn("peak_load=60kN", words)

    def test_it_prints(self):
        paper = self.folder / "report.pdf"
        printed = self.browse(f"--print-to-pdf={paper}", page=self.folder / "out" / "report.html")
        self.assertTrue(paper.exists(), printed.stderr[-2000:])
        data = paper.read_bytes()
        self.assertTrue(data.startswith(b"%PDF"))
        self.assertGreaterEqual(len(re.findall(rb"/Type\s*/Page\b", data)), 1)


if __name__ == "__main__":
    unittest.main()
