"""What Yosys and nextpnr write as JSON, for the scripts that read it."""
import json
import re


def top_cells(path):
    """{name: cell} of the top module; ValueError if the file has none."""
    with open(path) as file:
        modules = json.load(file)["modules"]
    for module in modules.values():
        if "top" in module["attributes"]:
            return module["cells"]
    raise ValueError("no module is the top")


def place_of(cell):
    """Where nextpnr has placed a cell: (column, row, position), the last of a LUT or register in its tile, 0 to 7, else None. None without a place."""
    place = re.match(r"X(\d+)/Y(\d+)/(?:SLICE([A-D])\.\D*(\d))?", cell["attributes"].get("NEXTPNR_BEL", ""))
    if not place:
        return None
    return int(place.group(1)), int(place.group(2)), 2 * "ABCD".index(place.group(3)) + int(place.group(4)) if place.group(3) else None
