"""What Yosys and nextpnr write as JSON, for the scripts that read it."""
import json
import os
import re


def top_of(design, path):
    """(name, module) of the top of what is in a file; ValueError if there is none."""
    for name, module in design["modules"].items():
        if "top" in module["attributes"]:
            return name, module
    raise ValueError("%s: no module is the top" % path)


def top_cells(path):
    """{name: cell} of the top module; ValueError if the file has none."""
    with open(path) as file:
        return top_of(json.load(file), path)[1]["cells"]


def add_settings(path, settings):
    """Writes settings of nextpnr, {name: text}, into a netlist."""
    with open(path) as file:
        design = json.load(file)
    top_of(design, path)[1].setdefault("settings", {}).update(settings)
    with open(path + ".tmp", "w") as file:
        json.dump(design, file)
    os.replace(path + ".tmp", path)


def instances_of(cell):
    """Instance path of a flattened cell, without indices and without what only holds the core: ["u_core", "u_leaf", "u_exit"]; [] above it."""
    parts = [part for part in re.sub(r"\[\d+\]", "", cell).split(".")[:-1] if part.startswith("u_")]
    return [part for part in parts if part not in ("u_board", "u_top")]


def place_of(cell):
    """Where nextpnr has placed a cell: (column, row, position), the last of a LUT or register in its tile, 0 to 7, else None. None without a place."""
    place = re.match(r"X(\d+)/Y(\d+)/(?:SLICE([A-D])\.\D*(\d))?", cell["attributes"].get("NEXTPNR_BEL", ""))
    if not place:
        return None
    return int(place.group(1)), int(place.group(2)), 2 * "ABCD".index(place.group(3)) + int(place.group(4)) if place.group(3) else None
