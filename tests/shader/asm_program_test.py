"""retrace-asm as people meet it: files, listing, round trip, and one line for everything that goes wrong.

usage: asm_program_test.py PROGRAM
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = ""
PROGRAMS = pathlib.Path(__file__).resolve().parents[2] / "golden/shader/programs"


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)


class Assembler(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name)
        self.addCleanup(self.folder.cleanup)

    def fails(self, code, text, *arguments):
        made = run(*arguments)
        self.assertEqual(made.returncode, code, made.stderr)
        self.assertEqual(made.stderr.count("\n"), 1, made.stderr)
        self.assertIn(text, made.stderr)
        self.assertEqual(made.stdout, "")

    def test_every_program_there_and_back(self):
        programs = sorted(PROGRAMS.glob("*.asm"))
        self.assertTrue(programs)
        for program in programs:
            words, text, again = (self.path / name for name in ("words.bin", "text.asm", "again.bin"))
            self.assertEqual(run(program, "-o", words).returncode, 0, program)
            self.assertEqual(run(words, "-d", "-o", text).returncode, 0, program)
            self.assertEqual(run(text, "-q", "-o", again).returncode, 0, program)
            self.assertEqual(words.read_bytes(), again.read_bytes(), program)
            self.assertEqual(words.stat().st_size % 16, 0)
        made = run(PROGRAMS / "unit_triangle.asm", "--listing")
        self.assertIn("13 words", made.stdout)

    def test_notes_and_listing(self):
        source = self.path / "a.asm"
        source.write_text("\nmov R0,0.6\n")
        made = run(source, "-o", self.path / "a.bin")
        self.assertEqual(made.stderr, "%s:2:8: note: 0.6 becomes 0.600097656: an immediate has 10 bits of fraction\n" % source)
        self.assertEqual(run(source, "-q", "-o", self.path / "a.bin").stderr, "")
        made = run(source, "-l")
        self.assertIn("mov R0, 0.60009765625", made.stdout)
        self.assertIn("note: column 8", made.stdout)

    def test_errors(self):
        source, target = self.path / "a.asm", self.path / "a.bin"
        source.write_text("mov R0,R1\nmov R0 R1\n")
        target.write_bytes(b"old")
        self.fails(1, "a.asm:2:8: expected ','", source, "-o", target)
        self.assertEqual(target.read_bytes(), b"old")
        self.fails(1, "cannot be read", self.path / "none.asm", "-o", target)
        self.fails(1, "cannot be read", self.path, "-o", target)
        self.fails(2, "nothing to do", source)
        self.fails(2, "--help", "-o", target)
        self.fails(2, "a.asm", source, "-o", source)
        self.fails(1, "no program", source, "-d", "-o", target)
        source.write_text("mov R0,R1\n")
        self.fails(1, "nowhere", source, "-o", self.path / "nowhere" / "a.bin")
        source.write_bytes(bytes(range(256)))
        self.fails(1, "a.asm:1:1: expected an instruction, found byte 0x00", source, "-o", target)
        self.assertEqual(target.read_bytes(), b"old")
        if os.path.exists("/dev/full"):
            source.write_text("mov R0,R1\n")
            self.fails(1, "/dev/full", source, "-o", "/dev/full")


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
