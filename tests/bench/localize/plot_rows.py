"""Draws the rows of the localization bench: error against its bound, honesty of the covariance, time against points.

usage: plot_rows.py ROWS.json OUT.svg     ROWS.json: what bench_localize --rows wrote
"""
import collections
import json
import math
import re
import sys

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

OURS, PEER, TARGET = "#1f5fa8", "#c26a1c", "#777777"


def cells(rows, measure):
    """{case: [(weldment, value, reference)]} of the rows "case weldment measure", in the bench's order."""
    found = collections.OrderedDict()
    for row in rows:
        name = row["name"]
        if not name.endswith(" " + measure) or name.startswith("pcl") or row["value"] is None:
            continue
        case, _, weldment = name[: -len(measure) - 1].rpartition(" ")
        found.setdefault(case, []).append((weldment, row["value"], row["reference"]))
    return found


def strip(axes, found, title, y_label, peer_label):
    """One column of dots a case; peers beside, a little to the right."""
    for x, (case, values) in enumerate(found.items()):
        spread = [x - 0.25 + 0.3 * i / max(1, len(values) - 1) for i in range(len(values))]
        axes.plot(spread, [v for _, v, _ in values], "o", color=OURS, markersize=4, label="weldcell" if x == 0 else None)
        peers = [(s + 0.35, r) for s, (_, _, r) in zip(spread, values) if r is not None]
        if peer_label and peers:
            axes.plot(*zip(*peers), "x", color=PEER, markersize=4, label=peer_label if x == 0 else None)
    axes.set_xticks(range(len(found)), list(found), rotation=20, ha="right")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
    axes.yaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    axes.set_title(title, loc="left", fontsize=10)
    axes.set_ylabel(y_label)


def line(axes, y, text):
    axes.axhline(y, color=TARGET, linewidth=0.8, linestyle="--")
    axes.annotate(text, (1, y), xycoords=("axes fraction", "data"), xytext=(-3, 3), textcoords="offset points",
                  ha="right", fontsize=7, color=TARGET)


def times(axes, rows):
    series = {"min": [], "median": [], "p99": []}
    for row in rows:
        match = re.fullmatch(r"time (\d+) points (min|median|p99)", row["name"])
        if match:
            series[match[2]].append((int(match[1]), row["value"]))
    if not series["median"]:
        axes.text(0.5, 0.5, "no time rows in this run", ha="center", transform=axes.transAxes)
        return
    points, median = zip(*series["median"])
    axes.plot(points, median, "o-", color=OURS, label="weldcell, median")
    axes.fill_between(points, [v for _, v in series["min"]], [v for _, v in series["p99"]], color=OURS, alpha=0.2,
                      label="min to p99")
    ratio = next((r["value"] for r in rows if r["name"] == "time paper / ours, 200 points"), None)
    if ratio:
        near = min(range(len(points)), key=lambda i: abs(math.log(points[i] / 200)))
        axes.plot([points[near]], [median[near] * ratio], "x", color=PEER, label="paper's method")
    for row in rows:
        if row["name"] == "pcl ICP base ladder time median, ours beside":
            near = min(range(len(points)), key=lambda i: abs(math.log(points[i] / 200)))
            axes.plot([points[near]], [row["value"]], "+", color=PEER, markersize=9, label="PCL's ICP")
    line(axes, 1, "1 ms, up to 300 points")
    line(axes, 3, "3 ms, up to 2000 points")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("edge points of one scan")
    axes.set_ylabel("CPU time of one scan, ms")
    axes.set_title("Time", loc="left", fontsize=10)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as source:
        rows = json.load(source)["rows"]
    ratio = collections.OrderedDict()
    for measure in ("RMS/CRLB", "RMS/GLS"):
        ratio.update(cells(rows, measure))
    plt.rcParams.update({"svg.hashsalt": "weldcell", "font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, (error, honest, time) = plt.subplots(3, 1, figsize=(9, 11), constrained_layout=True)
    strip(error, ratio, "Error against its bound (one dot a weldment)", "RMS / CRLB or GLS", "paper's method")
    line(error, 1.15, "1.15")
    nees = {case: values for case, values in cells(rows, "NEES").items() if case in ratio}
    strip(honest, nees, "Honesty of the covariance (1: as large as the errors are)", "NEES", None)
    line(honest, 0.7, "0.7")
    line(honest, 1.5, "1.5")
    times(time, rows)
    for axes in (error, honest, time):
        if axes.get_legend_handles_labels()[0]:
            axes.legend(frameon=False, fontsize=8, loc="upper left")
    figure.savefig(sys.argv[2], metadata={"Date": None})
    print(f"drawn: {sys.argv[2]}")


if __name__ == "__main__":
    main()
