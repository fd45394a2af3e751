"""Work counts of `retrace lab` keep the order of the literature on a surface seen from outside (the knot).

Foley & Sugerman 2005: restart > backtrack > stack in nodes visited; Horn et al. 2007: a short stack of 4 stays within
10 % of the full one. Camera rays, counted as interior nodes down and up. Prints the ratios. Usage: lab_ratios_test.py RETRACE
"""
import json
import subprocess
import sys

LIMIT = 1.10  # Horn et al.: the short stack's visits over the full stack's


def main() -> int:
    run = subprocess.run([sys.argv[1], "lab", "knot", "--only", "kd-sah", "--json"], capture_output=True, text=True, check=True)
    interior = {}
    for row in json.loads(run.stdout)["scenes"][0]["structures"]:
        if row["mailbox"] == 0:
            work = row["rays"]["primary"]["per_ray"]
            interior[row["key"].split("/")[1]] = work["down"] + work["up"]
    stack = interior["stack"]
    for name, visits in interior.items():
        print(f"{name}: {visits:.2f} interior nodes a ray, {visits / stack:.2f} of the stack")
    failed = False
    for back in ("backtrack-boxes", "backtrack-plane"):
        if not interior["restart"] > interior[back] > stack:
            print(f"restart > {back} > stack does not hold")
            failed = True
    if interior["short-stack-4"] > LIMIT * stack:
        print("the short stack of 4 visits more than 10 % more than the stack")
        failed = True
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
