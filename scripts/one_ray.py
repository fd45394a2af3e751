#!/usr/bin/env python3
"""Writes docs/one-ray.md and its two drawings: one ray through the six stages, with the values of every call.

usage: scripts/one_ray.py [--check] [--program FILE]

The values come from the program six_stages (tests/docs/six_stages.cpp), which calls the stages that are synthesized. --check compares with what is
committed and writes nothing.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
RAY = ["box", "64x64", "32,30"]  # scene, picture, pixel: the smallest walk that has work for every stage
AXES = "xyz"
FACES = ["lower x", "upper x", "lower y", "upper y", "lower z", "upper z"]
CONTRACT = tomllib.loads((ROOT / "scripts/contract/contract.toml").read_text(encoding="utf-8"))
FRACTION = {name: kind["frac_bits"] for name, kind in CONTRACT["type"].items()}
INK, PALE, BLUE, RED, GREEN = "#1f2937", "#cbd5e1", "#1d4ed8", "#b91c1c", "#15803d"


def value(code, kind):
    return code / 2 ** FRACTION[kind]


def number(x):
    return "%.6f" % x


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join(["---"] * len(head)) + " |"]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])


class Drawing:
    """A few shapes of SVG."""

    def __init__(self, width, height, title):
        self.parts = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %d %d" role="img" font-family="Helvetica, Arial, sans-serif">' % (width, height),
                      "<title>%s</title>" % title, '<rect width="%d" height="%d" fill="white"/>' % (width, height)]

    def line(self, x0, y0, x1, y1, colour=INK, width=1.5, dash=""):
        self.parts.append('<line x1="%.1f" y1="%.1f" x2="%.1f" y2="%.1f" stroke="%s" stroke-width="%.1f"%s/>'
                          % (x0, y0, x1, y1, colour, width, ' stroke-dasharray="%s"' % dash if dash else ""))

    def box(self, x, y, width, height, fill="none", colour=INK, opacity=1.0, radius=0):
        self.parts.append('<rect x="%.1f" y="%.1f" width="%.1f" height="%.1f" rx="%d" fill="%s" fill-opacity="%.2f" stroke="%s"/>'
                          % (x, y, width, height, radius, fill, opacity, colour))

    def dot(self, x, y, colour):
        self.parts.append('<circle cx="%.1f" cy="%.1f" r="4.5" fill="%s"/>' % (x, y, colour))

    def text(self, x, y, words, size=13, colour=INK, anchor="start", weight="normal"):
        words = words.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
        self.parts.append('<text x="%.1f" y="%.1f" font-size="%d" fill="%s" text-anchor="%s" font-weight="%s">%s</text>'
                          % (x, y, size, colour, anchor, weight, words))

    def arrow(self, points, colour=INK):
        for (x0, y0), (x1, y1) in zip(points, points[1:]):
            self.line(x0, y0, x1, y1, colour)
        (x0, y0), (x1, y1) = points[-2:]
        length = max(abs(x1 - x0), abs(y1 - y0))
        dx, dy = (x1 - x0) / length, (y1 - y0) / length
        self.parts.append('<polygon points="%.1f,%.1f %.1f,%.1f %.1f,%.1f" fill="%s"/>'
                          % (x1, y1, x1 - 9 * dx - 4 * dy, y1 - 9 * dy + 4 * dx, x1 - 9 * dx + 4 * dy, y1 - 9 * dy - 4 * dx, colour))

    def __str__(self):
        return "\n".join(self.parts + ["</svg>"]) + "\n"


def calls_of(ray, stage):
    return [call for call in ray["calls"] if call["stage"] == stage]


def draw_walk(ray):
    """The cells of the walk from the side: z to the left, as the ray flies to the right, y up."""
    drawing = Drawing(820, 640, "The walk of the ray through the leaves of the tree, seen from the side")
    place = lambda z, y: (410 - z * 340, 320 - y * 270)
    setup = calls_of(ray, "ray_setup")[0]
    origin = [value(code, "position") for code in setup["in"]["origin"]]
    direction = [value(code, "direction") for code in setup["in"]["direction"]]
    at = lambda t: place(origin[2] + t * direction[2], origin[1] + t * direction[1])
    box = [value(code, "position") for code in ray["box"]]
    left, top = place(box[5], box[3])
    right, bottom = place(box[4], box[2])
    drawing.box(left, top, right - left, bottom - top, "#f8fafc")
    for i, call in enumerate(calls_of(ray, "leaf_exit")):
        bound = [value(code, "position") for code in call["in"]["bound"]]
        (x0, y0), (x1, y1) = place(bound[5], bound[3]), place(bound[4], bound[2])
        drawing.box(x0, y0, x1 - x0, y1 - y0, ["#bfdbfe", "#fde68a", "#bbf7d0", "#fecaca"][i % 4], INK, 0.7)
        words = "leaf %d: node %d, %s" % (i + 1, call["node"], "empty" if call["count"] == 0 else "%d triangles" % call["count"])
        drawing.text((x0 + x1) / 2, y1 - 14, words, 14, INK, "middle", "bold")
    for call in calls_of(ray, "kd_descend"):
        split = value(call["in"]["split"], "position")
        if call["axis"] == 2:
            x, _ = place(split, 0)
            drawing.line(x, top, x, bottom, BLUE, 1, "6 4")
        elif call["axis"] == 1:
            _, y = place(0, split)
            drawing.line(left, y, right, y, BLUE, 1, "6 4")
    hit = calls_of(ray, "hit_finish")[0]["out"]
    end = value(hit["t"], "t_limit")
    drawing.line(*at(0), *at(end), RED, 3)
    drawing.dot(*at(0), RED)
    drawing.dot(*at(end), RED)
    x, y = at(0)
    drawing.text(x + 8, y + 22, "t = 0", 14, RED)
    for call in calls_of(ray, "leaf_exit"):
        t = value(call["out"]["t_exit"], "t")
        if t < end:
            drawing.dot(*at(t), BLUE)
            drawing.text(at(t)[0] - 8, at(t)[1] + 22, "t = %.4f" % t, 14, BLUE, "end")
    drawing.text(at(end)[0] - 8, at(end)[1] + 22, "hit, t = %.4f" % end, 14, RED, "end")
    drawing.text(left, top - 14, "side view of the scene box, z to the left, y up; dashed: split planes of the way down (not those across x)", 13)
    return str(drawing)


def draw_stages(ray):
    drawing = Drawing(1080, 470, "The six stages and what this ray gives them")
    first = {name: calls_of(ray, name) for name in ("ray_setup", "kd_descend", "leaf_exit", "kd_backtrack", "tri_test", "hit_finish")}
    setup, down, leaf, up = first["ray_setup"][0], first["kd_descend"][0], first["leaf_exit"][0], first["kd_backtrack"][-1]
    hit = first["hit_finish"][0]["out"]
    test = next(call for call in first["tri_test"] if call["out"]["hit"] and call["out"]["id"] == hit["id"])
    content = {
        "ray_setup": (30, 40, ["d.z = %s" % number(value(setup["in"]["direction"][2], "direction")),
                               "1 / d.z = %s" % number(setup["out"]["reciprocal"][2] / 2 ** setup["out"]["shift"][2])]),
        "kd_descend": (390, 40, ["node %d: split %s = %s" % (down["node"], AXES[down["axis"]], number(value(down["in"]["split"], "position"))),
                                 "t = %s  ->  node %d" % (number(value(down["in"]["t"], "t")), down["out"]["node"])]),
        "leaf_exit": (750, 40, ["node %d: face %s" % (leaf["node"], FACES[leaf["out"]["face"]]),
                                "t_exit = %s" % number(value(leaf["out"]["t_exit"], "t"))]),
        "kd_backtrack": (390, 200, ["node %d splits at the face:" % up["in"]["parent"],
                                    "on from its far child, node %d" % up["out"]["node"]]),
        "tri_test": (750, 200, ["triangle %d: hit" % test["out"]["id"], "t = %s" % number(value(test["out"]["t"], "t_limit"))]),
        "hit_finish": (750, 360, ["u = %s, v = %s" % (number(value(hit["u"], "barycentric")), number(value(hit["v"], "barycentric"))),
                                  "t = %s" % number(value(hit["t"], "t_limit"))]),
    }
    for name, (x, y, lines) in content.items():
        drawing.box(x, y, 300, 90, "#eff6ff", INK, 1.0, 8)
        count = len(first[name])
        drawing.text(x + 14, y + 26, name, 17, BLUE, "start", "bold")
        drawing.text(x + 286, y + 26, "%d call%s" % (count, "" if count == 1 else "s"), 13, INK, "end")
        for i, line in enumerate(lines):
            drawing.text(x + 14, y + 51 + 22 * i, line, 15)
    drawing.arrow([(330, 85), (390, 85)])
    drawing.arrow([(690, 85), (750, 85)])
    drawing.arrow([(900, 130), (900, 200)])
    drawing.arrow([(750, 245), (690, 245)])
    drawing.arrow([(540, 200), (540, 130)])
    drawing.arrow([(900, 290), (900, 360)])
    drawing.text(912, 170, "references of the leaf")
    drawing.text(740, 316, "no hit up to t_exit: climb", 13, INK, "end")
    drawing.line(720, 301, 720, 252, PALE)
    drawing.text(912, 322, "a hit up to t_exit,")
    drawing.text(912, 340, "or the end of the scene")
    drawing.text(552, 170, "down again")
    return str(drawing)


def page(ray):
    calls = {name: calls_of(ray, name) for name in ("ray_setup", "kd_descend", "leaf_exit", "kd_backtrack", "tri_test", "hit_finish")}
    setup, finish, work = calls["ray_setup"][0], calls["hit_finish"][0], ray["work"]
    scene, (width, height), (x, y) = ray["scene"], ray["size"], ray["pixel"]
    out = ["""# One ray, six stages

<!-- Written by scripts/one_ray.py from what six_stages prints. Do not edit. -->

The ray of pixel (%d, %d) of a picture of %d x %d of the scene `%s` (%d triangles), through the stages of the kernel one by one. Every code on
this page was computed by the stage functions that are synthesized. The program that prints them checks that the whole kernel gives the same hit, bit
for bit, with the same work: %d steps down, %d up, %d leaves, %d triangle tests.

    build/release/tests/docs/six_stages %s

![The six stages and what this ray gives them](one-ray-stages.svg)

A **code** is the integer in the hardware's registers; its value is the code divided by a power of two that the
[number contract](number-contract.md) states. Beside it stands what the golden stage gives in double precision.

![The walk of the ray, seen from the side](one-ray-walk.svg)
""" % (x, y, width, height, scene, ray["triangles"], work["down"], work["up"], work["leaf"], work["tests"], " ".join(RAY))]

    rows = []
    for axis in range(3):
        fixed = setup["out"]["reciprocal"][axis] / 2 ** setup["out"]["shift"][axis]
        rows.append([AXES[axis], setup["in"]["origin"][axis], number(value(setup["in"]["origin"][axis], "position")), setup["in"]["direction"][axis],
                     number(value(setup["in"]["direction"][axis], "direction")), setup["out"]["reciprocal"][axis], setup["out"]["shift"][axis],
                     number(fixed), number(setup["golden"]["reciprocal"][axis])])
    out.append("""## 1. `ray_setup`

Along the ray, a plane *s* of axis *a* is met at t = (s - o) / d. A walk asks this for every node, so the division is done once, here: the stage
gives the reciprocal of each component of the direction, as a mantissa and a shift.

%s
""" % table(["axis", "origin", "value", "direction", "value", "mantissa", "shift", "mantissa / 2^shift", "golden 1 / d"], rows))

    rows = []
    for i, call in enumerate(calls["kd_descend"]):
        near = (call["out"]["node"] & 1) == call["in"]["negative"]
        if call["out"]["node"] != call["golden"]["node"]:
            sys.exit("one_ray: golden goes elsewhere at node %d; choose another ray" % call["node"])
        rows.append([i + 1, call["node"], "%s = %s" % (AXES[call["axis"]], number(value(call["in"]["split"], "position"))), number(call["golden"]["t_plane"]),
                     number(value(call["in"]["t"], "t")), "near" if near else "far", call["out"]["node"]])
    out.append("""## 2. `kd_descend`

An interior node cuts its cell in two at a plane. With t, where the ray is, and the t of the plane, one comparison says which half comes next: the near
one if t < t_plane, otherwise the far one. One multiplication, no box test. Node 0 is the root; %s.

%s
""" % ("a negative t_plane lies behind the origin", table(["step", "node", "split", "t of the plane (golden)", "t", "child", "node of the child"], rows)))

    rows = [[i + 1, call["node"], call["count"], FACES[call["out"]["face"]], call["out"]["plane"], call["out"]["t_exit"],
             number(value(call["out"]["t_exit"], "t")), number(call["golden"]["t_exit"])] for i, call in enumerate(calls["leaf_exit"])]
    out.append("""## 3. `leaf_exit`

A leaf knows the six planes of its cell. The ray can leave through three of them; the one it meets first is the exit face.

%s
""" % table(["leaf", "node", "triangles", "exit face", "plane (code)", "t_exit (code)", "value", "golden"], rows))

    rows = []
    for call in calls["tri_test"]:
        got = call["out"]
        rows.append([call["in"]["id"], "yes" if got["hit"] else "no", got["t"] if got["hit"] else "", number(value(got["t"], "t_limit")) if got["hit"] else "",
                     "yes" if call["golden"]["hit"] else "no", number(call["golden"]["t"]) if call["golden"]["hit"] else ""])
    out.append("""## 4. `tri_test`

Each triangle brings a transform that makes it the unit triangle (0, 0), (1, 0), (0, 1) in the plane z = 0. In that space the test is a few products
and signs, and only a hit costs a division, for t.

%s
""" % table(["triangle", "hit", "t (code)", "value", "golden: hit", "golden: t"], rows))

    rows = [[i + 1, call["in"]["node"], call["in"]["parent"], "leaf" if call["in"]["parent_axis"] == 3 else AXES[call["in"]["parent_axis"]],
             call["in"]["parent_split"], FACES[call["in"]["face"]], call["in"]["plane"], "yes: turn" if call["out"]["matched"] else "no: climb on",
             call["out"]["node"]] for i, call in enumerate(calls["kd_backtrack"])]
    out.append("""## 5. `kd_backtrack`

Nothing nearer than t_exit was hit, so the ray goes on behind the exit face. There is no stack: the walk climbs to the ancestor that made that face. It
is found by comparing integers, as the plane of a face *is* the split of an ancestor, in every bit. Its far child is where the next way down begins.

%s
""" % table(["step", "node", "parent", "parent's axis", "parent's split (code)", "exit face", "plane (code)", "the place to turn?", "next node"], rows))

    rows = []
    for name, kind in (("t", "t_limit"), ("u", "barycentric"), ("v", "barycentric")):
        fixed, golden = value(finish["out"][name], kind), finish["golden"][name]
        rows.append([name, finish["out"][name], "%.9f" % fixed, "%.9f" % golden, "%.1f x 2^-24" % ((fixed - golden) * 2 ** 24)])
    if finish["out"]["id"] != finish["golden"]["id"]:
        sys.exit("one_ray: golden hits another triangle; choose another ray")
    out.append("""## 6. `hit_finish`

The best hit is on triangle %d. What is left are the two divisions of its barycentric coordinates, once a ray and not once a triangle.

%s

The differences are what fixed point costs; [error bounds](error-bounds.md) proves how large they can get.

## Go on

- The sources of a stage are short: `hls/stages/`, beside it `golden/engine/stages/` in doubles and `rtl/` in SystemVerilog.
- Another pixel: `six_stages box 64x64 20,20`. It prints JSON, one record a call.
- Why the walk never loses a ray: [memory image](memory-image.md#links-precisely). How the core keeps many rays in flight: [the RTL core](core.md).
""" % (finish["out"]["id"], table(["", "code", "value", "golden", "difference"], rows)))
    return "\n".join(out)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--program", default=str(ROOT / "build/release/tests/docs/six_stages"))
    arguments = parser.parse_args()
    ray = json.loads(subprocess.run([arguments.program, *RAY], check=True, stdout=subprocess.PIPE, text=True).stdout)
    texts = {"one-ray.md": page(ray), "one-ray-stages.svg": draw_stages(ray), "one-ray-walk.svg": draw_walk(ray)}
    stale = []
    for name, text in texts.items():
        path = ROOT / "docs" / name
        if path.exists() and path.read_text(encoding="utf-8") == text:
            continue
        stale.append("docs/" + name)
        if not arguments.check:
            path.write_text(text, encoding="utf-8")
    if stale and arguments.check:
        sys.exit("one_ray: %s is not what the stages give; run scripts/one_ray.py" % ", ".join(stale))
    print("one_ray: " + (("wrote " + ", ".join(stale)) if stale else "current"))


if __name__ == "__main__":
    main()
