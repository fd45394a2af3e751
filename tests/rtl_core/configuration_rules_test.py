#!/usr/bin/env python3
"""Every rule of rtl/targets/core.toml is an elaboration check: a configuration that breaks it is refused by the check's name, one that keeps it is not."""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "scripts"))
from rtl_rooms import rtl_packages, rtl_rooms  # noqa: E402

CONFIGURATIONS = "pkg/rt_config_pkg.sv"
# What is changed in ConfigEcp5, and the check that must refuse it.
BROKEN = [
    ({"lanes": 9}, "LanesKnown"),
    ({"contexts_per_lane": 8}, "ContextsEnough"),
    ({"contexts_per_lane": 48}, "ContextsPowerOfTwo"),
    ({"lanes": 8, "contexts_per_lane": 128}, "ContextsFit"),
    ({"data_bits": 32}, "DataBitsKnown"),
    ({"granule_bytes": 32}, "GranuleKnown"),
    ({"data_bits": 128, "granule_bytes": 8}, "GranuleKnown"),
    ({"granule_bytes": 64}, "LineIsGranules"),
    ({"node_line_pairs": 3}, "LinePairsKnown"),
    ({"node_pairs": 1000}, "SetsPowerOfTwo"),
    ({"leaf_lines": 100}, "SetsPowerOfTwo"),
    ({"list_lines": 96}, "SetsPowerOfTwo"),
    ({"triangle_lines": 1000}, "SetsPowerOfTwo"),
    ({"ways": 4}, "WaysKnown"),
    ({"mshrs": 1}, "MshrsFit"),
    ({"mshrs": 32}, "MshrsFit"),
    ({"mail_entries": 6}, "MailPowerOfTwo"),
    ({"hit_lines": 1}, "LinesKnown"),
    ({"hit_lines": 12}, "LinesKnown"),
    ({"hit_lines": 64}, "LinesKnown"),
    ({"launch_hops": 9}, "DepthSmall"),
    ({"levels": 3}, "LevelsKnown"),
    ({"levels": 2, "contexts_per_lane": 64}, "ContextsOfLevelsFit"),
    ({"pixels": 2}, "PixelsKnown"),
    ({"leaf_returns": 2}, "LeafReturnsOfOneLevel"),
    ({"leaf_returns": 1, "levels": 2}, "LeafReturnsOfOneLevel"),
]
ALLOWED = [{"lanes": 8, "contexts_per_lane": 64}, {"contexts_per_lane": 16}, {"granule_bytes": 64, "node_line_pairs": 4}, {"ways": 1}, {"mail_entries": 0}, {"hit_lines": 2}, {"mshrs": 16}, {"leaf_returns": 1, "launch_hops": 0},
           {"fill_hops": 0, "launch_hops": 0, "leaf_hops": 0}, {"levels": 2}, {"levels": 2, "mail_entries": 0, "launch_hops": 0},
           {"pixels": 1}, {"pixels": 1, "data_bits": 128, "granule_bytes": 64, "node_line_pairs": 4}]


def elaborate(changes):
    """Exit code and messages of Verilator for ConfigEcp5 with some fields changed."""
    text = (ROOT / "rtl/pkg/rt_config_pkg.sv").read_text()
    record = re.search(r"localparam config_t ConfigEcp5 = '\{(.*?)\};", text, re.S).group(1)
    for field, value in changes.items():
        record, count = re.subn(r"\b%s: \d+" % field, "%s: %d" % (field, value), record)
        assert count == 1, field
    with tempfile.TemporaryDirectory() as folder:
        package = pathlib.Path(folder, "rt_config_pkg.sv")
        package.write_text(text.replace("endpackage", "  localparam config_t ConfigTried = '{%s};\nendpackage" % record))
        run = subprocess.run(["verilator", "--lint-only", "-Wno-lint", "+define+RT_CONFIG=ConfigTried", "+incdir+rtl/pkg",
                              *[word for name in rtl_rooms("board") for word in ("-y", "rtl/" + name)],
                              *[str(package) if name == CONFIGURATIONS else "rtl/" + name for name in rtl_packages()], "rtl/shell/rt_top.sv", "--top-module", "rt_top"],
                             cwd=ROOT, capture_output=True, text=True)
    return run.returncode, run.stdout + run.stderr


class ConfigurationRules(unittest.TestCase):
    def test_broken(self):
        for changes, check in BROKEN:
            with self.subTest(changes=changes):
                code, text = elaborate(changes)
                self.assertNotEqual(code, 0)
                self.assertIn("parameter check %s failed" % check, text)

    def test_allowed(self):
        for changes in ALLOWED:
            with self.subTest(changes=changes):
                code, text = elaborate(changes)
                self.assertEqual(code, 0, text[-2000:])


if __name__ == "__main__":
    unittest.main()
