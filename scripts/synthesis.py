"""Yosys' synthesis for an ECP5, with what its technology mapping does not know of the part.

usage: python synthesis.py --top MODULE --read COMMAND --output NETLIST.json [--floorplan FILE]   (in the environment that has pyosys; scripts/bitstream runs it)

Mapping trades depth for area where a path has time left, and makes the rest as shallow as it can. It takes the way between two LUTs for shorter than
it is on a full part, and does not know that the output of a block RAM comes late, so that a path behind one was made as deep as any other. Here
the way has WIRE_PS, and each output of a block RAM goes through a cell with a delay, which is a wire again after mapping. Before mapping, block RAMs
and multipliers take in the registers around them that they have themselves; after it, those that a floorplan names get their places.
"""
import argparse
import re
import tomllib

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


def cells_of(module, kind):
    return [cell for cell in module.selected_cells() if cell.type.str() == kind]


def bits_of(cell, *prefixes):
    """{port: bit} of the one-bit ports that begin with one of the prefixes and a digit, and are connected."""
    return {port.str(): signal[0] for port, signal in cell.connections().items()
            if signal.size() > 0 and re.fullmatch(r"\\(%s)\d+" % "|".join(prefixes), port.str())}


class Netlist:
    """Who drives and who reads the bits at block RAMs and multipliers."""

    def __init__(self, design):
        self.module = design.top_module()
        self.alias = {}
        for target, source in self.module.connections():
            for bit, driver in zip(target.bits(), source.bits()):
                if bit.is_wire():
                    self.alias[(bit.wire.name.str(), bit.offset)] = self.key(driver)
        self.rams = cells_of(self.module, "\\DP16KD")
        self.multipliers = cells_of(self.module, "\\MULT18X18D")
        self.readers = {}  # of outputs of both, and of what multiplies
        for cell in self.rams + self.multipliers:
            for bit in bits_of(cell, "DOA", "DOB", "P", "A", "B").values():
                self.readers[self.key(bit)] = []
        self.registers = {}  # by the bit that they drive
        self.late = {self.key(bit) for cell in self.rams + self.multipliers for bit in bits_of(cell, "DOA", "DOB", "P").values()}
        for cell in self.module.selected_cells():
            for port, signal in cell.connections().items():
                if cell.input(port):
                    for bit in signal.bits():
                        name = self.key(bit)
                        if name in self.readers:
                            self.readers[name].append((cell, port.str()))
            if cell.type.str() == "\\TRELLIS_FF":
                self.registers[self.key(cell.getPort(ys.IdString("\\Q"))[0])] = cell
        for wire in self.module.selected_wires():
            if wire.port_output:
                for bit in ys.SigSpec(wire).bits():
                    self.readers.get(self.key(bit), []).append((None, ""))

    def key(self, bit):
        """Name of what drives a bit; None for a constant."""
        name = (bit.wire.name.str(), bit.offset) if bit.is_wire() else None
        while name in self.alias:
            name = self.alias[name]
        return name

    def is_plain(self, cell):
        """A register that loads in every clock and has no reset."""
        parameter = {name.str(): value.decode_string().strip() for name, value in cell.parameters.items()}
        enabled = parameter["\\CEMUX"] == "1" or (parameter["\\CEMUX"] == "CE" and constant(cell, "\\CE", True) is True)
        return parameter["\\CLKMUX"] == "CLK" and enabled and constant(cell, "\\LSR", False) is False

    def clock_of(self, register):
        return self.key(register.getPort(ys.IdString("\\CLK"))[0])

    def register_behind(self, bit):
        """The plain register that is all that reads a bit."""
        readers = self.readers[self.key(bit)]
        if len(readers) != 1 or readers[0][0] is None:
            return None
        cell, port = readers[0]
        return cell if cell.type.str() == "\\TRELLIS_FF" and port == "\\DI" and self.is_plain(cell) else None

    def register_before(self, bit):
        """The plain register that drives a bit, if it follows a register: behind logic it stays where the logic is."""
        cell = self.registers.get(self.key(bit))
        if cell is None or not self.is_plain(cell):
            return None
        source = self.key(cell.getPort(ys.IdString("\\DI"))[0])
        return cell if source is None or source in self.registers or source in self.late else None

    def take_outputs(self, cell, ports, clock=None):
        """Moves a cell's outputs behind the registers that follow them; the clock of these, or None if one output has no such register."""
        used = {port: bit for port, bit in ports.items() if self.readers[self.key(bit)]}
        behind = {port: self.register_behind(bit) for port, bit in used.items()}
        if not used or None in behind.values():
            return None
        clocks = {self.clock_of(register) for register in behind.values()} | ({clock} if clock else set())
        if len(clocks) != 1:
            return None
        clock_port = next(iter(behind.values())).getPort(ys.IdString("\\CLK"))
        for port, register in behind.items():
            output = register.getPort(ys.IdString("\\Q"))
            cell.setPort(ys.IdString(port), output)
            del self.registers[self.key(output[0])]
            self.late.add(self.key(output[0]))
            self.readers.setdefault(self.key(output[0]), [(None, "")])
            self.module.remove(register)
        return clock_port


def constant(cell, port, absent):
    signal = cell.connections().get(ys.IdString(port))
    return (signal.as_const().as_bool() if signal.is_fully_const() else None) if signal is not None else absent


def absorb_registers(design):
    """Registers that block RAMs and multipliers have themselves: plain ones behind all their outputs, and for a multiplier before all its inputs."""
    netlist = Netlist(design)
    rams = products = operands = 0
    for cell in netlist.rams:
        if netlist.take_outputs(cell, bits_of(cell, "DOA", "DOB"), netlist.key(cell.getPort(ys.IdString("\\CLKB"))[0])) is not None:
            rams += 1
            # At 36 bits the two halves of a word are the outputs of the two ports.
            for side in "AB" if cell.getParam(ys.IdString("\\DATA_WIDTH_B")).as_int() == 36 else "B":
                cell.setParam(ys.IdString("\\REGMODE_" + side), ys.Const("OUTREG"))
                cell.setPort(ys.IdString("\\OCE" + side), ys.SigSpec(ys.State.S1, 1))
    for cell in netlist.multipliers:
        # Inputs first: afterwards the same registers may have no other reader.
        inputs = {port: bit for port, bit in bits_of(cell, "A", "B").items() if netlist.key(bit) is not None}
        before = {port: netlist.register_before(bit) for port, bit in inputs.items()}
        clock = None
        if inputs and None not in before.values() and len({netlist.clock_of(register) for register in before.values()}) == 1:
            operands += 1
            clock = next(iter(before.values())).getPort(ys.IdString("\\CLK"))
            for port, register in before.items():
                cell.setPort(ys.IdString(port), register.getPort(ys.IdString("\\DI")))
            enable_registers(cell, ("INPUTA", "INPUTB"), clock)
        clock = netlist.take_outputs(cell, bits_of(cell, "P"), netlist.key(clock[0]) if clock is not None else None)
        if clock is not None:
            products += 1
            enable_registers(cell, ("OUTPUT",), clock)
    print("synthesis: registers behind %d of %d block RAMs, before %d and behind %d of %d multipliers are their own" % (
        rams, len(netlist.rams), operands, products, len(netlist.multipliers)))
    ys.run_pass("opt_clean", design)


def enable_registers(multiplier, which, clock):
    for name in which:
        for what, value in (("CLK", "CLK0"), ("CE", "CE0"), ("RST", "RST0")):
            multiplier.setParam(ys.IdString("\\REG_%s_%s" % (name, what)), ys.Const(value))
    multiplier.setParam(ys.IdString("\\GSR"), ys.Const("DISABLED"))
    multiplier.setPort(ys.IdString("\\CLK0"), clock)
    multiplier.setPort(ys.IdString("\\CE0"), ys.SigSpec(ys.State.S1, 1))
    multiplier.setPort(ys.IdString("\\RST0"), ys.SigSpec(ys.State.S0, 1))


def delay_block_rams(design):
    module = design.top_module()
    number = 0
    cells = [cell for cell in cells_of(module, "\\DP16KD") if cell.getParam(ys.IdString("\\REGMODE_B")).decode_string() != "OUTREG"]
    for cell in cells:
        for port in bits_of(cell, "DOA", "DOB"):
            number += 1
            late = module.addWire(ys.IdString("\\late_wire_%d" % number), 1)
            box = module.addCell(ys.IdString("\\late_%d" % number), ys.IdString("\\RT_LATE"))
            box.setPort(ys.IdString("\\I"), ys.SigSpec(late))
            box.setPort(ys.IdString("\\O"), cell.getPort(ys.IdString(port)))
            cell.setPort(ys.IdString(port), ys.SigSpec(late))
    print("synthesis: %d block RAMs answer late" % len(cells))


def site_names(sites, row):
    """BELs of a row, from the left."""
    return ["X%d/Y%d/%s" % (group + column, row, bel) for group in sites["groups"] for bel, column in sites["bels"].items()]


def natural(name):
    """Sorts by what a cell belongs to, the numbers as numbers, the way of a cache last."""
    way = re.search(r"gen_way\[(\d+)\]", name)
    plain = re.sub(r"gen_way\[\d+\]", "", name)
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", plain)], way.group(1) if way else ""


def place(design, path):
    """Gives block RAMs and multipliers the places of a floorplan; a place is given once."""
    with open(path, "rb") as file:
        plan = tomllib.load(file)
    taken, placed = set(), set()
    for entry in plan["place"]:
        cells = [cell for cell in cells_of(design.top_module(), "\\" + entry["kind"])
                 if re.search(entry["cells"], cell.name.str()) and cell.name.str() not in placed]
        rows = [site_names(plan["sites"][entry["kind"]], row)[entry["first"]:] for row in entry["rows"]]
        lists = [[] for _ in rows]
        for number, cell in enumerate(sorted(cells, key=lambda cell: natural(cell.name.str()))):
            way = re.search(r"gen_way\[(\d+)\]", cell.name.str())
            split = entry.get("split")
            lists[int(way.group(1)) if split == "way" else number // 4 % len(rows) if split == "fours" else 0].append(cell)
        for row, members in zip(rows, lists):
            for bel, cell in zip([bel for bel in row if bel not in taken], members):
                taken.add(bel)
                placed.add(cell.name.str())
                cell.set_string_attribute(ys.IdString("\\BEL"), bel)
    print("synthesis: %d block RAMs and multipliers have a place" % len(placed))


parser = argparse.ArgumentParser()
parser.add_argument("--top", required=True)
parser.add_argument("--read", required=True)
parser.add_argument("--output", required=True)
parser.add_argument("--floorplan", help="places of block RAMs and multipliers, as constraints/lfe5u-85f.toml")
arguments = parser.parse_args()

design = ys.Design()
design.scratchpad_set_string("synth_lattice.abc9.W", str(WIRE_PS))
ys.run_pass(arguments.read, design)
# Copies of a register that the source wants kept (rt_copies): Yosys keeps a wire with the attribute, not the register that drives it.
ys.run_pass("setattr -set keep 1 */w:*copy_q %ci1 */t:$dff %i", design)
ys.run_pass("synth_ecp5 -run begin:map_luts -top " + arguments.top, design)
read_text(design, "late", DELAY % BLOCK_RAM_PS, "read_verilog -lib -specify")
absorb_registers(design)
delay_block_rams(design)
ys.run_pass("synth_ecp5 -run map_luts:map_cells -top " + arguments.top, design)
read_text(design, "wire", WIRE, "techmap -map")
ys.run_pass("synth_ecp5 -run map_cells: -top " + arguments.top, design)
if arguments.floorplan:
    place(design, arguments.floorplan)
ys.run_pass("write_json " + arguments.output, design)
