"""Registers that take an input of another clock domain have the attribute ASYNC_REG: tools then place them side by side and neither duplicate them
nor make shift registers in memory of them. A synchroniser is a register into which an input of its module is shifted, and nothing else.

usage: synchronisers_test.py [--rtl FOLDER]
"""
import argparse
import glob
import os
import re
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
RTL = os.path.join(ROOT, "rtl")
SHIFT = re.compile(r"\b(\w+)\s*<=\s*\{\s*\1\s*(?:\[[^\]]*\])?\s*,\s*(\w+_i)\s*\}\s*;")
ATTRIBUTE = r'\(\*[^*]*\bASYNC_REG\s*=\s*"TRUE"[^*]*\*\)\s*(?:logic|reg)\b[^;]*\b%s\b'


def synchronisers(text):
    """Names of the synchronisers in a source text, each with whether it has the attribute."""
    text = re.sub(r"//[^\n]*", "", text)
    return {name: re.search(ATTRIBUTE % name, text) is not None for name, _ in SHIFT.findall(text)}


class Synchronisers(unittest.TestCase):
    def test_each_has_the_attribute(self):
        found = {}
        for path in sorted(glob.glob(RTL + "/**/*.*v", recursive=True)):
            with open(path) as file:
                for name, attribute in synchronisers(file.read()).items():
                    found[os.path.basename(path), name] = attribute
        self.assertIn(("rt_uart_rx.sv", "line_q"), found)
        self.assertIn(("rt_reset.sv", "good_q"), found)
        self.assertEqual([where for where, attribute in found.items() if not attribute], [])

    def test_one_without_is_found(self):
        body = " logic [2:0] a_q;\n always_ff @(posedge clk_i) a_q <= {a_q[1:0], pin_i};\n"
        self.assertEqual(synchronisers(body), {"a_q": False})
        self.assertEqual(synchronisers(' (* ASYNC_REG = "TRUE" *)' + body), {"a_q": True})
        self.assertEqual(synchronisers(' // (* ASYNC_REG = "TRUE" *)\n' + body), {"a_q": False})
        self.assertEqual(synchronisers(' (* ASYNC_REG = "TRUE" *) logic b_q;\n' + body), {"a_q": False})


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--rtl", default=RTL)
    arguments, rest = parser.parse_known_args()
    RTL = arguments.rtl
    unittest.main(argv=[sys.argv[0], *rest])
