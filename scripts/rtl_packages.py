"""The SystemVerilog packages in the order in which tools have to read them (rtl/packages.txt)."""
import os

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def rtl_packages(*folders):
    """Paths below rtl/; with folders, of those alone."""
    with open(os.path.join(ROOT, "rtl/packages.txt")) as file:
        paths = [line.strip() for line in file if line.strip() and not line.startswith("#")]
    return [path for path in paths if not folders or path.split("/")[0] in folders]
