"""Yosys' synthesis for an ECP5, with what its technology mapping does not know of the part.

usage: python synthesis.py --top MODULE --read COMMAND --output NETLIST.json   (in the environment that has pyosys; scripts/bitstream runs it)

Mapping trades depth for area where a path has time left, and makes the rest as shallow as it can. It takes the way between two LUTs for shorter than
it is on a full part, and does not know that the output of a block RAM comes late, so that a path behind one was made as deep as any other. Here
the way has WIRE_PS, and each output of a block RAM goes through a cell with a delay, which is a wire again after mapping.
"""
import argparse

from pyosys import libyosys as ys

# In ps, as measured after routing: from one LUT to the next; from the clock to the output of a block RAM (5.8 ns, and the way out of its row).
WIRE_PS = 700
BLOCK_RAM_PS = 6500
DELAY = "(* abc9_box *) module RT_LATE(input I, output O); specify (I => O) = %d; endspecify endmodule\n"
WIRE = "module RT_LATE(input I, output O); assign O = I; endmodule\n"


def read_text(design, name, text, options):
    path = "%s.%s.v" % (arguments.output, name)
    with open(path, "w") as file:
        file.write(text)
    ys.run_pass("%s %s" % (options, path), design)


def delay_block_rams(design):
    module = design.top_module()
    number = 0
    cells = [cell for cell in module.selected_cells() if cell.type.str() == "\\DP16KD"]
    for cell in cells:
        for port, signal in cell.connections().items():
            if not port.str().startswith("\\DO") or signal.size() == 0:
                continue
            number += 1
            late = module.addWire(ys.IdString("\\late_wire_%d" % number), signal.size())
            cell.setPort(port, ys.SigSpec(late))
            box = module.addCell(ys.IdString("\\late_%d" % number), ys.IdString("\\RT_LATE"))
            box.setPort(ys.IdString("\\I"), ys.SigSpec(late))
            box.setPort(ys.IdString("\\O"), signal)
    print("synthesis: %d block RAMs answer late" % len(cells))


parser = argparse.ArgumentParser()
parser.add_argument("--top", required=True)
parser.add_argument("--read", required=True)
parser.add_argument("--output", required=True)
arguments = parser.parse_args()

design = ys.Design()
design.scratchpad_set_string("synth_lattice.abc9.W", str(WIRE_PS))
ys.run_pass(arguments.read, design)
ys.run_pass("synth_ecp5 -run begin:map_luts -top " + arguments.top, design)
read_text(design, "late", DELAY % BLOCK_RAM_PS, "read_verilog -lib -specify")
delay_block_rams(design)
ys.run_pass("synth_ecp5 -run map_luts:map_cells -top " + arguments.top, design)
read_text(design, "wire", WIRE, "techmap -map")
ys.run_pass("synth_ecp5 -run map_cells: -top " + arguments.top, design)
ys.run_pass("write_json " + arguments.output, design)
