"""The completions that shakerctl prints, in the shells themselves."""
import shutil
import subprocess
import unittest

from support import Scratch, run

SHELLS = ("bash", "zsh", "fish")


class Completion(Scratch):
    def setUp(self):
        super().setUp()
        for shell in SHELLS:
            self.write(f"complete.{shell}", run("completion", shell).stdout)
        (self.path / "files").mkdir()
        self.write("files/rig.json", "{}")
        (self.path / "files" / "folder").mkdir()

    def ask(self, *command):
        if not shutil.which(command[0]):
            self.skipTest(f"{command[0]} is not installed")
        result = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=self.path / "files",
                                env={"PATH": "/usr/bin:/bin", "HOME": str(self.path), "TERM": "xterm"})
        self.assertEqual(result.stderr, "")
        return result.stdout

    def bash(self, *words):
        """What bash offers for the last of the words after shakerctl."""
        line = " ".join(f"'{word}'" for word in ("shakerctl", *words))
        return set(self.ask("bash", "-c", f"source ../complete.bash; COMP_WORDS=({line}); COMP_CWORD={len(words)}; "
                                          '_shakerctl; printf "%s\\n" "${COMPREPLY[@]}"').split())

    def fish(self, *words):
        return {line.split("\t")[0] for line in self.ask(
            "fish", "-c", f"source ../complete.fish; complete -C 'shakerctl {' '.join(words)}'").splitlines()}

    def test_every_shell_finds_its_script_good(self):
        for shell in SHELLS:
            with self.subTest(shell=shell):
                self.ask(shell, "-n", f"../complete.{shell}")

    def test_commands_options_choices_and_files_are_offered(self):
        for offered in (self.bash, self.fish):
            with self.subTest(shell=offered.__name__):
                self.assertEqual(offered("es"), {"estimate", "estop"})
                self.assertEqual(offered("export", "--directory", ""), {"folder"} if offered == self.bash else {"folder/"})
                self.assertEqual(offered("estimate", "--mo"), {"--model"})
                self.assertEqual(offered("estimate", "--bias", ""), {"auto", "off", "always"})
                self.assertLess({"rig.json"}, offered("check", "") | offered("check", "f"))
                self.assertEqual(offered("check", "--rig", "r"), {"rig.json"})
                self.assertEqual(offered("estimate", "--frequency", ""), set())
                self.assertEqual(offered("status", "x"), set())
                self.assertNotIn("--job", offered("diagnose", "--"))

    def test_zsh_offers_commands_options_and_choices(self):
        driver = self.write("ask.zsh", r"""
zmodload zsh/zpty
zpty -b shell zsh -f -i
# Reads until the shell has said so, at most 15 s.
until_said() {
  integer tries=150
  while (( tries-- )) && [[ $said != *$1* ]]; do
    while zpty -r -t shell line; do said+=$line; done
    sleep 0.1
  done
}
# Types $1 and Tab, waits for $2, clears the line.
say() { zpty -w -n shell $1$'\t'; until_said $2; zpty -w -n shell $'\x15' }
zpty -w shell "PS1='RE''ADY '; LISTMAX=1000; fpath=($PWD/zsh \$fpath); autoload -U compinit; compinit -u -d $PWD/dump"
until_said READY
say 'shakerctl prove-d' 'prove-deadman '
say 'shakerctl estimate --stag' '--stagewise '
say 'shakerctl export --format u' '--format uff '
print -r -- $said
""")
        (self.path / "zsh").mkdir()
        (self.path / "complete.zsh").rename(self.path / "zsh" / "_shakerctl")
        if not shutil.which("zsh"):
            self.skipTest("zsh is not installed")
        answer = subprocess.run(["zsh", "-f", driver], capture_output=True, text=True, timeout=60, cwd=self.path,
                                env={"PATH": "/usr/bin:/bin", "HOME": str(self.path), "TERM": "dumb"}).stdout
        for wanted in ("prove-deadman ", "--stagewise ", "--format uff "):
            self.assertIn(wanted, answer)


if __name__ == "__main__":
    unittest.main()
