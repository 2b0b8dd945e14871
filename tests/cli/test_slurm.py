"""A job array on a real Slurm of one node: a part is killed and queued again, the merge is that of one run."""
import getpass
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

from support import ROOT, SHAKERCTL, run
from sanitized import SANITIZED

WORDS = ("monte-carlo", "--figure", "13", "--replications", "40000", "--threads", "1")


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


class Slurm:
    """A controller and a node, without accounts, in a folder of its own."""

    def __init__(self, folder):
        self.folder = folder
        user, name = getpass.getuser(), socket.gethostname().split(".")[0]
        (folder / "state").mkdir()
        (folder / "spool").mkdir()
        conf = folder / "slurm.conf"
        conf.write_text(f"""ClusterName=test
SlurmctldHost={name}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
SlurmctldPort={free_port()}
SlurmdPort={free_port()}
AuthType=auth/none
CredType=cred/none
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SwitchType=switch/none
MpiDefault=none
NodeName={name} NodeAddr=127.0.0.1 CPUs={os.cpu_count()} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
""")
        self.environment = {**os.environ, "SLURM_CONF": str(conf)}
        step = pathlib.Path("/usr/sbin/slurmstepd-wlm")
        self.processes = [
            subprocess.Popen(["slurmctld", "-D"], env=self.environment, stdout=subprocess.DEVNULL,
                             stderr=subprocess.DEVNULL),
            subprocess.Popen(["slurmd", "-D", "-N", name, *(["-d", step] if step.exists() else [])],
                             env=self.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)]
        if not self.await_state(lambda: "idle" in self.ask("sinfo", "-h", "-o", "%T"), 60):
            logs = [log.read_text() for log in folder.glob("*.log")]
            self.stop()
            raise AssertionError("Slurm does not start:\n" + "\n".join(logs))

    def ask(self, *words):
        return subprocess.run(words, env=self.environment, capture_output=True, text=True).stdout

    @staticmethod
    def await_state(reached, seconds):
        end = time.monotonic() + seconds
        while not reached():
            if time.monotonic() > end:
                return False
            time.sleep(0.1)
        return True

    def submit(self, folder, parts, *words):
        made = subprocess.run([ROOT / "cli/slurm/submit", folder, str(parts), *words], env=self.environment,
                              capture_output=True, text=True)
        return made.returncode, made.stdout + made.stderr

    def finish(self):
        """Waits for the end of all jobs. One that was queued again would begin two minutes later."""
        def over():
            for job in self.ask("squeue", "-h", "-t", "PENDING", "-o", "%i %r").splitlines():
                if job.endswith("BeginTime"):
                    self.ask("scontrol", "update", f"JobId={job.split()[0]}", "StartTime=now")
            return not self.ask("squeue", "-h").strip()
        return self.await_state(over, 200)

    def stop(self):
        for process in reversed(self.processes):
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def process_of(words):
    """The process whose command line holds these words; None: there is none."""
    for place in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            line = (place / "cmdline").read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        if all(word in line for word in words):
            return int(place.name)
    return None


class Array(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="slurm."))
        self.addCleanup(shutil.rmtree, self.folder, True)
        self.slurm = Slurm(self.folder)
        self.addCleanup(self.slurm.stop)

    def test_a_killed_part_is_made_again_and_the_merge_is_that_of_one_run(self):
        parts = self.folder / "parts"
        status, said = self.slurm.submit(parts, 4, SHAKERCTL, *WORDS)
        self.assertEqual(status, 0, said)
        killed = []

        def kill():
            found = process_of(("--shard", "2/4", "monte-carlo"))
            if found:
                os.kill(found, signal.SIGKILL)
                killed.append(found)
            return found

        self.assertTrue(self.slurm.await_state(kill, 60), "part 2 has not begun")
        self.assertTrue(self.slurm.finish(), self.slurm.ask("squeue"))
        log = (parts / "part-2.log").read_text()
        self.assertIn("part 2: ended by signal 9, queued again", log)
        files = sorted(parts.glob("part-*.jsonl"))
        self.assertEqual([f.name for f in files], [f"part-{i}.jsonl" for i in range(1, 5)], log)
        self.assertEqual(sorted(parts.glob("*.jsonl.*")), [], "half a file was left")

        whole, merged = run(*WORDS, "--json"), run(*WORDS, "--json", "--merge", *files)
        self.assertEqual(merged.returncode, 0, merged.stderr)
        self.assertEqual(whole.stdout, merged.stdout)

        made = {f: f.stat().st_mtime_ns for f in files}
        files[2].unlink()
        status, said = self.slurm.submit(parts, 4, SHAKERCTL, *WORDS)
        self.assertEqual(status, 0, said)
        self.assertTrue(self.slurm.finish(), self.slurm.ask("squeue"))
        self.assertEqual(run(*WORDS, "--json", "--merge", *files).stdout, whole.stdout)
        self.assertEqual([f.name for f in files if f.stat().st_mtime_ns != made[f]], ["part-3.jsonl"])

    def test_says_how_to_call_it(self):
        for words, sentence in (((self.folder, 4), "Usage: submit FOLDER PARTS COMMAND"),
                                ((self.folder, "four", "true"), '"four" is no number of parts')):
            status, said = self.slurm.submit(*words)
            self.assertEqual(status, 2)
            self.assertIn(sentence, said)


if __name__ == "__main__":
    if SANITIZED or shutil.which("slurmctld") is None:
        print("Slurm is not installed (package slurm-wlm), or the programs run under a sanitizer")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="slurm.") as first:
        try:
            Slurm(pathlib.Path(first)).stop()
        except AssertionError as trouble:  # no rights for it here
            print(str(trouble)[-300:].replace("\n", "; "))
            sys.exit(77)
    unittest.main()
