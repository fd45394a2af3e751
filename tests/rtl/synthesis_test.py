"""scripts/synthesis.py: which registers become those of a block RAM or a multiplier, and which must not; places of a floorplan; kept copies.

usage: synthesis_test.py [--build FOLDER]
"""
import argparse
import json
import os
import subprocess
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOOLS = os.environ.get("RETRACE_PYTHON", os.path.join(ROOT, ".env/py/bin/python"))
BUILD = ""

RAM = """
module dut(input clk, input en, input rst, input we, input [8:0] wa, ra, input [35:0] d, output reg [35:0] q, output [35:0] other);
  (* no_rw_check *) reg [35:0] m[0:511];
  reg [35:0] r;
  always @(posedge clk) begin
    if (we) m[wa] <= d;
    r <= m[ra];
    %s
  end
  assign other = %s;
endmodule
"""
MUL = """
module dut(input clk, input en, input signed [17:0] a, b, output reg signed [35:0] p);
  reg signed [17:0] a1, b1, a2, b2;
  always @(posedge clk) begin
    a1 <= a;
    b1 <= b;
    %s
  end
endmodule
"""


def synthesize(name, text, floorplan=None, read="read_verilog"):
    source, netlist = os.path.join(BUILD, name + ".v"), os.path.join(BUILD, name + ".json")
    with open(source, "w") as file:
        file.write(text)
    command = [TOOLS, os.path.join(ROOT, "scripts/synthesis.py"), "--top", "dut", "--read", "%s %s" % (read, source), "--output", netlist]
    run = subprocess.run(command + (["--floorplan", floorplan] if floorplan else []), capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr[-2000:]
    with open(netlist) as file:
        return json.load(file)["modules"]["dut"]["cells"]


def of_type(cells, kind):
    return [cell for cell in cells.values() if cell["type"] == kind]


class BlockRam(unittest.TestCase):
    def modes(self, name, register, other="36'd0"):
        cells = synthesize(name, RAM % (register, other))
        ram, = of_type(cells, "DP16KD")
        return ram["parameters"]["REGMODE_A"], ram["parameters"]["REGMODE_B"], len(of_type(cells, "TRELLIS_FF"))

    def test_a_plain_register_is_taken_in(self):
        self.assertEqual(self.modes("ram_plain", "q <= r;"), ("OUTREG", "OUTREG", 0))

    def test_one_with_an_enable_is_not(self):
        self.assertEqual(self.modes("ram_enable", "if (en) q <= r;"), ("NOREG", "NOREG", 36))

    def test_one_with_a_reset_is_not(self):
        self.assertEqual(self.modes("ram_reset", "q <= rst ? 36'd0 : r;"), ("NOREG", "NOREG", 36))

    def test_nor_one_whose_word_is_read_elsewhere(self):
        self.assertEqual(self.modes("ram_other", "q <= r;", "r"), ("NOREG", "NOREG", 36))

    def test_nor_one_behind_logic(self):
        self.assertEqual(self.modes("ram_logic", "q <= r ^ {36{en}};")[:2], ("NOREG", "NOREG"))

    def test_nor_a_part_of_the_word(self):
        self.assertEqual(self.modes("ram_part", "q <= {r[35:1], r[0] ^ en};")[:2], ("NOREG", "NOREG"))


class Multiplier(unittest.TestCase):
    def registers(self, name, body):
        cells = synthesize(name, MUL % body)
        multiplier, = of_type(cells, "MULT18X18D")
        return tuple(multiplier["parameters"].get("REG_%s_CLK" % which, "NONE") for which in ("INPUTA", "INPUTB", "OUTPUT")), len(of_type(cells, "TRELLIS_FF"))

    def test_operands_and_product(self):
        self.assertEqual(self.registers("mul_all", "a2 <= a1; b2 <= b1; p <= a2 * b2;"), (("CLK0", "CLK0", "CLK0"), 36))

    def test_an_enabled_product_stays_outside(self):
        self.assertEqual(self.registers("mul_enable", "a2 <= a1; b2 <= b1; if (en) p <= a2 * b2;")[0], ("CLK0", "CLK0", "NONE"))

    def test_operands_only_together(self):
        self.assertEqual(self.registers("mul_one", "a2 <= a1; if (en) b2 <= b1; p <= a2 * b2;")[0], ("NONE", "NONE", "CLK0"))

    def test_operands_behind_logic_stay_with_it(self):
        self.assertEqual(self.registers("mul_logic", "a2 <= a1 + b1; b2 <= b1; p <= a2 * b2;")[0], ("NONE", "NONE", "CLK0"))


class Floorplan(unittest.TestCase):
    def test_a_site_is_given_once(self):
        plan = os.path.join(BUILD, "plan.toml")
        with open(plan, "w") as file:
            file.write("""[sites.DP16KD]
groups = [4]
bels = { EBR0 = 0, EBR1 = 2 }
[[place]]
kind = "DP16KD"
cells = 'm\\.'
rows = [22]
first = 1
[[place]]
kind = "DP16KD"
cells = '.'
rows = [22]
first = 0
""")
        text = RAM.replace("[35:0]", "[143:0]") % ("q <= r;", "144'd0")
        places = [cell["attributes"].get("BEL", "") for cell in of_type(synthesize("places", text.replace("36'd0", "144'd0"), plan), "DP16KD")]
        self.assertEqual(sorted(places), ["", "", "X4/Y22/EBR0", "X6/Y22/EBR1"])


class Copies(unittest.TestCase):
    """rt_copies: equal registers that stay apart, and what would happen to them otherwise."""

    TEXT = """
module dut(input logic clk, input logic [3:0] d, output logic [11:0] q);
  rt_copies #(.Copies(3), .data_t(logic [3:0])) u_copies (.clk_i(clk), .data_i(d), .data_o(q));
endmodule
"""

    def registers(self, name, change):
        with open(os.path.join(ROOT, "rtl/stream/rt_copies.sv")) as file:
            module = file.read()
        self.assertIn("copy_q", module)
        text = module.replace("copy_q", change) + self.TEXT
        return len(of_type(synthesize(name, text, read="read_slang --top dut"), "TRELLIS_FF"))

    def test_each_copy_is_kept(self):
        self.assertEqual(self.registers("copies", "copy_q"), 12)

    def test_without_their_name_they_are_one(self):
        self.assertEqual(self.registers("copies_merged", "other_q"), 4)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", default=os.path.join(ROOT, "build/synthesis_test"))
    arguments, rest = parser.parse_known_args()
    BUILD = os.path.abspath(arguments.build)
    os.makedirs(BUILD, exist_ok=True)
    unittest.main(argv=[sys.argv[0], *rest])
