"""The report of nights: one page of HTML that stands by itself, from the records that scripts/nightly keeps.

A record of a night: began, seconds, commit, changes, seed, host, runs, trend. A run: name, what, passed (jobs), seconds (of its jobs), failed: a list with name,
fault, command, tail, ended. trend: figures by name.
"""
import base64
import datetime
import html
import re
import shlex

STYLE = """body { font: 15px/1.45 sans-serif; margin: 2em auto; max-width: 75em; padding: 0 1em; color: #222 }
table { border-collapse: collapse } td, th { border-bottom: 1px solid #ddd; padding: .25em .7em; text-align: left; vertical-align: top } td.n { text-align: right }
pre { background: #f5f5f5; padding: .6em; overflow-x: auto; white-space: pre-wrap } .passed { color: #1b6e3c } .failed { color: #b3261e; font-weight: bold } img { max-width: 100% }"""
SHOWN = 14  # nights


def base(name):
    """A job's name without its seed: the same job in another night."""
    return re.sub(r"-seed\d+$", "", name)


def day(night):
    return datetime.datetime.fromtimestamp(night["began"]).strftime("%Y-%m-%d %H:%M")


def commit(night):
    return night["commit"][:12] + (" and changes" if night["changes"] else "")


def run_of(night, name):
    return next((run for run in night["runs"] if run["name"] == name), None)


def failed_since(nights, run, name):
    """The first night of those, up to the last, in which this job of this run failed every time that the run ran."""
    since = nights[-1]
    for night in reversed(nights):
        found = run_of(night, run)
        if found is None:
            continue
        if all(base(failure["name"]) != base(name) for failure in found["failed"]):
            break
        since = night
    return since


def hours(seconds):
    return "%d:%02d h" % divmod(round(seconds / 60), 60)


def cell(run):
    if run is None:
        return "<td>–</td>"
    if run["failed"]:
        return '<td class="failed">%d of %d FAILED</td>' % (len(run["failed"]), len(run["failed"]) + run["passed"])
    return '<td class="passed">passed</td>'


def failures(nights):
    """Failures of the last night, the first one first; (run, failure, since when)."""
    found = [(run["name"], failure) for run in nights[-1]["runs"] for failure in run["failed"]]
    found.sort(key=lambda pair: (pair[1]["ended"] is None, pair[1]["ended"]))
    return [(name, failure, failed_since(nights, name, failure["name"])) for name, failure in found]


def page(nights, picture=None):
    """nights: records, the oldest first; the page is about the last. picture: an SVG of trends, as bytes."""
    last, shown, write = nights[-1], nights[-SHOWN:], html.escape
    jobs, bad = sum(run["passed"] + len(run["failed"]) for run in last["runs"]), failures(nights)
    parts = ["<!DOCTYPE html><html lang='en'><meta charset='utf-8'><title>Retrace: night of %s</title><style>%s</style>" % (day(last), STYLE),
             "<h1>Night of %s</h1>" % day(last),
             "<p>Commit %s, seed %d, on %s: <b class='%s'>%d of %d jobs passed</b>, %s in all, %s of jobs.</p>" % (
                 write(commit(last)), last["seed"], write(last["host"]), "failed" if bad else "passed", jobs - len(bad), jobs, hours(last["seconds"]),
                 hours(sum(run["seconds"] for run in last["runs"])))]
    if bad:
        parts.append("<h2>What failed, in the order of time</h2>")
        for name, failure, since in bad:
            parts.append("<h3>%s</h3><p>Run <code>%s</code>: %s. Fails since the night of %s, commit %s.</p><pre>%s</pre><pre>%s</pre>" % (
                write(failure["name"]), write(name), write(failure["fault"]), day(since), write(commit(since)), write(shlex.join(failure["command"])),
                write("\n".join(failure["tail"])) or "(no output)"))
    parts.append("<h2>What ran</h2><table><tr><th>run</th><th>what</th><th>jobs</th><th>time</th>%s</tr>" % "".join("<th>%s</th>" % day(night).replace(" ", "<br>") for night in reversed(shown)))
    for run in last["runs"]:
        parts.append("<tr><td><code>%s</code></td><td>%s</td><td class='n'>%d</td><td class='n'>%s</td>%s</tr>" % (
            write(run["name"]), write(run["what"]), run["passed"] + len(run["failed"]), hours(run["seconds"]), "".join(cell(run_of(night, run["name"])) for night in reversed(shown))))
    parts.append("</table>")
    names = list(dict.fromkeys(name for night in shown for name in night["trend"]))
    if names:
        parts.append("<h2>Figures</h2><table><tr><th></th>%s</tr>" % "".join("<th>%s</th>" % day(night).replace(" ", "<br>") for night in reversed(shown)))
        for name in names:
            parts.append("<tr><td>%s</td>%s</tr>" % (write(name), "".join("<td class='n'>%s</td>" % ("%.2f" % night["trend"][name] if name in night["trend"] else "–") for night in reversed(shown))))
        parts.append("</table>")
    if picture is not None:
        parts.append("<h2>Trends</h2><img alt='Time of each run and figures, night by night' src='data:image/svg+xml;base64,%s'>" % base64.b64encode(picture).decode())
    return "\n".join(parts) + "\n"


def draw(nights, path):
    """Time of each run, and figures as a share of the first night that has them."""
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "retrace", "font.size": 9})
    import matplotlib.pyplot as plt
    shown = nights[-SHOWN:]
    figure, axes = plt.subplots(1, 2, figsize=(12, 5), layout="constrained")
    for name in dict.fromkeys(run["name"] for night in shown for run in night["runs"]):
        points = [(place, run_of(night, name)) for place, night in enumerate(shown) if run_of(night, name)]
        line, = axes[0].plot([place for place, _ in points], [max(run["seconds"], 1) / 60 for _, run in points], "o-", markersize=3, linewidth=1, label=name)
        bad = [(place, max(run["seconds"], 1) / 60) for place, run in points if run["failed"]]
        axes[0].plot([x for x, _ in bad], [y for _, y in bad], "x", color=line.get_color(), markersize=9)
    axes[0].set(yscale="log", ylabel="minutes of jobs", title="time of each run (x: failed)")
    for name in dict.fromkeys(name for night in shown for name in night["trend"]):
        points = [(place, night["trend"][name]) for place, night in enumerate(shown) if name in night["trend"]]
        axes[1].plot([place for place, _ in points], [value / points[0][1] for _, value in points], "o-", markersize=3, linewidth=1, label=name)
    axes[1].set(title="figures, first night shown = 1")
    for axis in axes:
        axis.set_xticks(range(len(shown)), [day(night)[5:10] for night in shown], rotation=60)
        axis.grid(True, linewidth=0.3, alpha=0.6)
        if axis.get_legend_handles_labels()[0]:
            axis.legend(fontsize=7, ncols=2)
    figure.savefig(path, format="svg", metadata={"Date": None})
    plt.close(figure)
