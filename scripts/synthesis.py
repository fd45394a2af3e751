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


def block_rams(module):
    return [cell for cell in module.selected_cells() if cell.type.str() == "\\DP16KD"]


def outputs(cell):
    """{port: bit} of a block RAM's data outputs that are connected."""
    return {port: signal[0] for port, signal in cell.connections().items() if port.str().startswith("\\DO") and signal.size() > 0}


def constant(cell, port, absent):
    signal = cell.connections().get(ys.IdString(port))
    return (signal.as_const().as_bool() if signal.is_fully_const() else None) if signal is not None else absent


def absorb_registers(design):
    """A register behind every output of a block RAM, without enable and reset, is the one that the block RAM has at its outputs."""
    module = design.top_module()
    alias = {}

    def key(bit):
        """Name of what drives a bit; None for a constant."""
        name = (bit.wire.name.str(), bit.offset) if bit.is_wire() else None
        while name in alias:
            name = alias[name]
        return name

    for target, source in module.connections():
        for bit, driver in zip(target.bits(), source.bits()):
            if bit.is_wire():
                alias[(bit.wire.name.str(), bit.offset)] = key(driver)

    rams = block_rams(module)
    readers = {key(bit): [] for cell in rams for bit in outputs(cell).values()}
    for cell in module.selected_cells():
        for port, signal in cell.connections().items():
            if cell.input(port):
                for bit in signal.bits():
                    name = key(bit)
                    if name in readers:
                        readers[name].append((cell, port.str()))
    for wire in module.selected_wires():
        if wire.port_output:
            for bit in ys.SigSpec(wire).bits():
                readers.get(key(bit), []).append((None, ""))

    def register_behind(bit, clock):
        """The register that is all that reads a bit."""
        if len(readers[key(bit)]) != 1:
            return None
        cell, port = readers[key(bit)][0]
        if cell is None or cell.type.str() != "\\TRELLIS_FF" or port != "\\DI":
            return None
        parameter = {name.str(): value.decode_string() for name, value in cell.parameters.items()}
        plain = parameter["\\CLKMUX"].strip() == "CLK" and parameter["\\REGSET"].strip() == "RESET" and constant(cell, "\\LSR", False) is False
        enabled = parameter["\\CEMUX"].strip() == "1" or (parameter["\\CEMUX"].strip() == "CE" and constant(cell, "\\CE", True) is True)
        return cell if plain and enabled and key(cell.getPort(ys.IdString("\\CLK"))[0]) == clock else None

    absorbed = registers = 0
    for cell in rams:
        used = {port: bit for port, bit in outputs(cell).items() if readers[key(bit)]}
        clock = key(cell.getPort(ys.IdString("\\CLKB"))[0])
        behind = {port: register_behind(bit, clock) for port, bit in used.items()}
        if not used or None in behind.values():
            continue
        for port, register in behind.items():
            cell.setPort(port, register.getPort(ys.IdString("\\Q")))
            module.remove(register)
        for side in "AB":
            cell.setParam(ys.IdString("\\REGMODE_" + side), ys.Const("OUTREG"))
            cell.setPort(ys.IdString("\\OCE" + side), ys.SigSpec(ys.State.S1, 1))
        absorbed += 1
        registers += len(behind)
    print("synthesis: %d of %d block RAMs have taken in the %d registers behind them" % (absorbed, len(rams), registers))


def delay_block_rams(design):
    module = design.top_module()
    number = 0
    cells = [cell for cell in block_rams(module) if cell.getParam(ys.IdString("\\REGMODE_B")).decode_string() != "OUTREG"]
    for cell in cells:
        for port, bit in outputs(cell).items():
            signal = ys.SigSpec([bit])
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
absorb_registers(design)
delay_block_rams(design)
ys.run_pass("synth_ecp5 -run map_luts:map_cells -top " + arguments.top, design)
read_text(design, "wire", WIRE, "techmap -map")
ys.run_pass("synth_ecp5 -run map_cells: -top " + arguments.top, design)
ys.run_pass("write_json " + arguments.output, design)
