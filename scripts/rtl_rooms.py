"""What is where below rtl/: its rooms from the lowest up (rtl/rooms.txt), and the packages in the order in which tools have to read them (rtl/packages.txt)."""
import os

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def lines_of(name):
    with open(os.path.join(ROOT, "rtl", name)) as file:
        return [line.strip() for line in file if line.strip() and not line.startswith("#")]


def rtl_rooms(below=None):
    """Names of the folders; with `below`, of those under that one."""
    rooms = lines_of("rooms.txt")
    return rooms if below is None else rooms[:rooms.index(below)]


def rtl_packages(*rooms):
    """Paths below rtl/; with rooms, of those alone."""
    return [path for path in lines_of("packages.txt") if not rooms or path.split("/")[0] in rooms]
