"""verify: a seal finds every tampered byte, and a seal is not lost."""
import json
import os
import random
import shutil
import subprocess
import unittest

from support import EXAMPLES, MAKE_CAMPAIGN, Scratch, run
from sanitized import SANITIZED

TAMPERED = 20 if SANITIZED else 1000


class Verify(Scratch):
    def setUp(self):
        super().setUp()
        table = self.write("table.csv", "2,3,0.01,0.02,0.01,-0.01\n3,3,0.02,0.01,0.03,0.02\n")
        made = subprocess.run([MAKE_CAMPAIGN, self.path, table, EXAMPLES / "model-oleo.json"],
                              capture_output=True, text=True, check=True)
        self.file = self.path / os.path.basename(made.stdout.strip())

    def verified(self, *words, code=0):
        result = run("verify", *words)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def test_every_tampered_byte_is_found(self):
        self.verified(self.file, "--seal")
        sound, draw = self.file.read_bytes(), random.Random(4)
        for _ in range(TAMPERED):
            tampered = bytearray(sound)
            at = draw.randrange(len(tampered))
            tampered[at] ^= draw.randrange(1, 256)
            self.file.write_bytes(tampered)
            self.assertEqual(run("verify", self.file).returncode, 1, f"byte {at}")
        self.file.write_bytes(sound)
        self.assertIn("every byte", self.verified(self.file).stdout)

    def test_the_seal_is_one_that_sha256sum_reads(self):
        self.verified(self.file, "--seal")
        checked = subprocess.run(["sha256sum", "--check", f"{self.file.name}.sha256"], cwd=self.path,
                                 capture_output=True, text=True)
        self.assertEqual(checked.returncode, 0, checked.stderr)
        seal = (self.path / f"{self.file.name}.sha256").read_text()
        self.assertIn("sound", self.verified(self.file, "--sha256", seal.split()[0]).stdout)
        self.assertIn("not 00", self.verified(self.file, "--sha256", 64 * "0", code=1).stderr)

    def test_a_seal_is_neither_replaced_nor_put_on_what_is_damaged(self):
        sealed = self.path / f"{self.file.name}.sha256"
        sound = self.file.read_bytes()
        self.file.write_bytes(sound.replace(b"2026-03-01T12:00:00", b"2026-03-01T11:00:00"))
        self.assertIn("does not match its checksum", self.verified(self.file, "--seal", code=1).stderr)
        self.assertFalse(sealed.exists())
        self.file.write_bytes(sound)
        self.assertIn("There is no seal", self.verified(self.file).stdout)
        sealed.write_text(64 * "0" + f"  {self.file.name}\n")
        self.assertIn("it is not replaced", self.verified(self.file, "--seal", code=2).stderr)
        self.assertEqual(sealed.read_text()[:4], "0000")
        sealed.write_text("nothing\n")
        self.assertIn("is not a seal", self.verified(self.file, code=2).stderr)

    def test_a_folder_has_a_seal_over_all_its_files(self):
        folder = self.path / "campaign"
        folder.mkdir()
        (folder / "r1.csv").write_text("t,displacement\n" + "".join(f"{0.01 * i},{0.1 * (i % 7)}\n"
                                                                    for i in range(200)))
        (folder / "campaign.json").write_text(json.dumps(
            {"format": "shaker-campaign/1", "runs": [{"name": "r1", "kind": "transient"}]}))
        self.verified(folder, "--seal")
        self.assertIn("every byte", self.verified(folder).stdout)
        copy = self.path / "copy"
        shutil.copytree(folder, copy)
        with (copy / "r1.csv").open("a") as out:
            out.write("2.0,0.1\n")
        (copy / "notes.txt").write_text("later")
        broken = json.loads(self.verified(copy, "--json", code=1).stdout)
        self.assertEqual(broken["troubles"], ["notes.txt was not there when it was sealed",
                                              "r1.csv is not as it was sealed"])
        (copy / "r1.csv").unlink()
        self.assertIn("r1.csv is missing", self.verified(copy, code=1).stderr)

    def test_several_are_verified_one_after_the_other(self):
        other = self.path / "other.db"
        other.write_bytes(self.file.read_bytes().replace(b"2026-03-01T12:00:00", b"2026-03-01T11:00:00"))
        both = self.verified(self.file, other, code=1)
        self.assertIn("sound", both.stdout)
        self.assertIn("other.db: 1 row does not match its checksum", both.stderr)
        self.assertIn("of one campaign", self.verified(self.file, other, "--sha256", 64 * "0", code=2).stderr)

    def test_what_is_no_campaign_is_told(self):
        (self.path / "empty").mkdir()
        self.assertIn("is a folder without", self.verified(self.path / "empty", code=2).stderr)
        self.assertIn("no such campaign", self.verified(self.path / "none.db", code=2).stderr)


if __name__ == "__main__":
    unittest.main()
