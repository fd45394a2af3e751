"""Static timing analysis of a placed ECP5: every path that is too slow before routing, by module.

usage: placed_timing.py PLACED.json [--mhz MHZ] [--classes N] [--paths N] [--find REGEX]

PLACED.json is what nextpnr writes with --write, also with --no-route: nextpnr itself says nothing of timing without routing, and after it names one path.
Here every endpoint (register, block RAM, multiplier) has its arrival, and those that are late are grouped by where their slowest path begins and ends.

--mhz       endpoints later than its period are listed (default 80).
--classes   how many groups of late endpoints are printed, the largest first (default 40).
--paths     how many of the latest paths are printed hop by hop: arrival in ns, place, cell (default 0).
--find      only endpoints whose cell name matches.

Delays in ps are those of nextpnr for speed grade 6. A wire is taken for what its placer takes it (ecp5/arch.cc, predictDelay): 98 for each of three steps,
two for each of the first five columns and rows between the cells and one for each of the others; nothing from a register to the LUT beside it and from LUT to
LUT of a tile. Cells as below, without setup times. The clock that follows is 2 to 12 % below nextpnr's own after placement on the designs it was
compared on (rt_ulx3s), so it is good for what is late and not for how late; routing adds what has to go around.
"""
import argparse
import collections
import re
import sys

import placed_netlist

FF_OUT, RAM_OUT, RAM_REGISTER_OUT, PRODUCT, PRODUCT_OUT, PRODUCT_REGISTER_OUT = 525, 5830, 970, 3930, 3860, 740
LUT, LUT_TO_WIDE, WIDE_SELECT, WIDE_INPUT = 236, 403, 258, 239
CARRY_ENTER, CARRY_PASS, CARRY_LEAVE = 450, 71, 440
WIRE_STEP, WIRE_START, NEAR = 98, 3, 5
NO_PLACE = 600  # for a cell without a place (pads)


def wired(cell):
    """Ports of a cell that are connected to a net."""
    return {port for port, bits in cell["connections"].items() if bits and isinstance(bits[0], int)}


def registered(cell, what):
    return cell["parameters"].get(what, "NONE").strip() != "NONE"


def clock_to_output(cell, port):
    """Delay of an output that a clock launches, or None."""
    kind = cell["type"]
    if kind == "TRELLIS_FF":
        return FF_OUT
    if kind == "DP16KD":
        return RAM_REGISTER_OUT if cell["parameters"].get("REGMODE_B") == "OUTREG" else RAM_OUT
    if kind == "MULT18X18D" and port.startswith("P"):
        if registered(cell, "REG_OUTPUT_CLK"):
            return PRODUCT_REGISTER_OUT
        return PRODUCT_OUT if registered(cell, "REG_INPUTA_CLK") else None
    return None


def is_endpoint(cell, port):
    kind = cell["type"]
    if kind == "TRELLIS_FF":
        return port in ("DI", "M", "CE", "LSR")
    if kind == "DP16KD":
        return cell["port_directions"][port] == "input" and not port.startswith("CLK")
    if kind == "MULT18X18D":
        return port[0] in "AB" and (registered(cell, "REG_INPUTA_CLK") or registered(cell, "REG_OUTPUT_CLK"))
    if kind == "TRELLIS_RAMW":
        return port != "WCK"
    return kind == "TRELLIS_COMB" and port in ("WD", "WAD0", "WRE")


def arcs_through(cell):
    """[(input, output, delay)] of the combinational ways through a cell."""
    ports = wired(cell)
    inputs = ports & set("ABCD")
    found = []
    if cell["type"] == "TRELLIS_COMB" and cell["parameters"].get("MODE", "").strip() == "CCU2":
        found += [(port, output, CARRY_ENTER) for port in inputs for output in ("F", "FCO")]
        found += [("FCI", "F", CARRY_LEAVE), ("FCI", "FCO", CARRY_PASS)]
    elif cell["type"] == "TRELLIS_COMB":
        found += [(port, output, delay) for port in inputs for output, delay in (("F", LUT), ("OFX", LUT_TO_WIDE))]
        found += [("M", "OFX", WIDE_SELECT), ("FXA", "OFX", WIDE_INPUT), ("FXB", "OFX", WIDE_INPUT)]
    elif cell["type"] == "MULT18X18D" and not registered(cell, "REG_INPUTA_CLK") and not registered(cell, "REG_OUTPUT_CLK"):
        found += [(port, output, PRODUCT) for port in ports if re.fullmatch(r"[AB]\d+", port) for output in ports if output.startswith("P")]
    return [arc for arc in found if arc[0] in ports and arc[1] in ports]


class Timing:
    """Arrivals of a placed netlist. A pin is (cell's name, port)."""

    def __init__(self, path):
        self.cells = placed_netlist.top_cells(path)
        self.places = {name: placed_netlist.place_of(cell) for name, cell in self.cells.items()}
        self.net, readers = {}, collections.defaultdict(list)
        for name, cell in self.cells.items():
            for port in wired(cell):
                bit = cell["connections"][port][0]
                if cell["port_directions"][port] == "output":
                    self.net[(name, port)] = bit
                else:
                    readers[bit].append((name, port))
        self.arrival, self.before, self.endpoints = {}, {}, {}
        self.propagate(readers)

    def propagate(self, readers):
        arcs, waiting = collections.defaultdict(list), collections.Counter()
        for name, cell in self.cells.items():
            for port, output, delay in arcs_through(cell):
                arcs[(name, port)].append(((name, output), delay))
                waiting[(name, output)] += 1
        ready = []
        for pin in self.net:
            launched = clock_to_output(self.cells[pin[0]], pin[1])
            if launched is not None:
                self.arrival[pin] = launched
            elif not waiting[pin]:
                self.arrival[pin] = float("-inf")  # constants, pads, clocks
            else:
                continue
            ready.append(pin)
        while ready:
            source = ready.pop()
            for pin in readers[self.net[source]]:
                time = self.arrival[source] + self.wire(source, pin)
                self.arrival[pin], self.before[pin] = time, source
                if is_endpoint(self.cells[pin[0]], pin[1]) and time > 0:
                    self.endpoints[pin] = time
                for output, delay in arcs[pin]:
                    if time + delay > self.arrival.get(output, float("-inf")) or output not in self.arrival:
                        self.arrival[output], self.before[output] = time + delay, pin
                    waiting[output] -= 1
                    if not waiting[output]:
                        ready.append(output)

    def wire(self, source, pin):
        if (source[1], pin[1]) in (("FCO", "FCI"), ("F", "DI")) or pin[1] in ("FXA", "FXB"):
            return 0
        here, there = self.places[source[0]], self.places[pin[0]]
        if here is None or there is None:
            return NO_PLACE
        if here[:2] == there[:2] and pin[1] in ("A", "B", "C", "D"):
            if (source[1] == "Q" and here[2] == there[2]) or (source[1] == "F" and here[2] not in (1, 6)):
                return 0
        steps = [abs(a - b) for a, b in zip(here[:2], there[:2])]
        return WIRE_STEP * (WIRE_START + sum(max(step - NEAR, 0) + 2 * min(step, NEAR) for step in steps))

    def path_to(self, pin):
        path = [pin]
        while path[-1] in self.before:
            path.append(self.before[path[-1]])
        return path[::-1]


def group_of(name):
    """A cell's name without bits, indices and what mapping appended."""
    name = re.sub(r"\[\d+\]|\$.*|_(LUT4|PFUMX|L6MUX21|CCU2C|TRELLIS_FF|DP16KD|MULT18X18D).*", "", name)
    return re.sub(r"\b(u_board|u_top|u_core|gen_\w+)\.", "", name)


def end_of(timing, pin):
    port = pin[1] if timing.cells[pin[0]]["type"] != "TRELLIS_FF" or pin[1] in ("CE", "LSR") else ""
    return group_of(pin[0]) + (":" + re.sub(r"\d+$", "", port) if port else "")


def describe(timing, mhz, classes, paths, find):
    period = 1e6 / mhz
    endpoints = {pin: time for pin, time in timing.endpoints.items() if not find or re.search(find, pin[0])}
    if not endpoints:
        sys.exit("placed_timing: no endpoint" + (" matches %s" % find if find else ""))
    late = sorted((pin for pin, time in endpoints.items() if time > period), key=lambda pin: -endpoints[pin])
    worst = max(endpoints.values())
    print("%.2f MHz before routing; %d of %d endpoints later than %.2f ns" % (1e6 / worst, len(late), len(endpoints), period / 1000))
    groups = collections.defaultdict(list)
    for pin in late:
        groups[(group_of(timing.path_to(pin)[0][0]), end_of(timing, pin))].append(pin)
    if late:
        print("%6s %6s %6s %6s  %s" % ("late", "ns", "wires", "cells", "slowest path of the group"))
    for (begin, end), pins in sorted(groups.items(), key=lambda item: -len(item[1]))[:classes]:
        path = timing.path_to(pins[0])
        wires = sum(timing.wire(timing.before[pin], pin) for pin in path if pin in timing.before and pin not in timing.net)
        between = sum(1 for pin in path[1:] if pin in timing.net)
        print("%6d %6.1f %6.1f %6d  %s -> %s" % (len(pins), endpoints[pins[0]] / 1000, wires / 1000, between, begin, end))
    for pin in sorted(endpoints, key=lambda pin: -endpoints[pin])[:paths]:
        print("path of %.2f ns:" % (endpoints[pin] / 1000))
        for hop in timing.path_to(pin):
            print("  %6.2f  %-10s %s.%s (%s)" % (timing.arrival[hop] / 1000, "%d,%d" % timing.places[hop[0]][:2] if timing.places[hop[0]] else "?", hop[0], hop[1],
                                                timing.cells[hop[0]]["type"]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("placed")
    parser.add_argument("--mhz", type=float, default=80.0)
    parser.add_argument("--classes", type=int, default=40)
    parser.add_argument("--paths", type=int, default=0)
    parser.add_argument("--find", default="")
    arguments = parser.parse_args()
    try:
        timing = Timing(arguments.placed)
    except (OSError, ValueError, KeyError) as error:
        sys.exit("placed_timing: %s is no netlist of nextpnr: %s" % (arguments.placed, error or type(error).__name__))
    if arguments.mhz <= 0:
        sys.exit("placed_timing: --mhz %g is not positive" % arguments.mhz)
    describe(timing, arguments.mhz, arguments.classes, arguments.paths, arguments.find)


if __name__ == "__main__":
    main()
