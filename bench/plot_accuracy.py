#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Plots CSV files of bench/accuracy (and bench/front): error against time, one curve a method, and the error in every pixel.

usage: plot_accuracy.py --study ACCURACY.csv [--front FRONT.csv] -o ACCURACY.png
       plot_accuracy.py --picture PIXELS.csv -o PICTURE.png
"""
import argparse
import csv
import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

LEVELS = ("fast", "refined", "certified", "reference")
SOLVER_WORKLOADS = ("view", "silhouettes within 1e-3", "collapsed edges")
STEPS_SHOWN = 12  # later ones are where these end


def read(name):
    with open(name, newline="") as file:
        return list(csv.DictReader(file))


def finish(axes, title, x, y, legend="best"):
    axes.set(xscale="log", yscale="log", title=title, xlabel=x, ylabel=y)
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="major", linewidth=0.3)
    if legend:
        axes.legend(fontsize=7, loc=legend)


def draw_levels(axes, rows):
    rows = [row for row in rows if row["study"] == "levels"]
    workloads = list(dict.fromkeys(row["workload"] for row in rows))
    marks = dict(zip(workloads, "osD^v<>Pp*"))
    for level in LEVELS:
        points = [row for row in rows if row["method"] == level and float(row["p999"]) > 0]
        color = f"C{LEVELS.index(level)}"
        for row in points:
            axes.scatter(float(row["ns"]), float(row["p999"]), color=color, marker=marks[row["workload"]], s=30)
        axes.scatter([], [], color=color, label=level)
    for workload in workloads:
        axes.scatter([], [], color="gray", marker=marks[workload], label=workload)
    finish(axes, "levels, by family of rays", "time a ray [ns]", "p99.9 of the error [diagonals]", None)
    axes.set_ylim(top=1e5)
    axes.legend(fontsize=7, loc="upper center", ncol=3)


def draw_solver(axes, rows, workload):
    rows = [row for row in rows if row["workload"] == workload and float(row["p999"]) > 0]
    curves = {}
    for row in rows:
        if row["study"] == "steps" and int(row["value"]) <= STEPS_SHOWN:
            curves.setdefault((row["method"], row["number"]), []).append(row)
    for (method, number), points in curves.items():
        points.sort(key=lambda row: int(row["value"]))
        x, y = [float(row["ns"]) for row in points], [float(row["p999"]) for row in points]
        line = axes.plot(x, y, "o-" if number == "double" else "s--", markersize=3, linewidth=1,
                         label=f"{method}, {number}: 1 to {STEPS_SHOWN} steps")[0]
        axes.annotate("1", (x[0], y[0]), textcoords="offset points", xytext=(-7, 0), fontsize=7,
                      color=line.get_color())
    for row in rows:
        if row["study"] not in ("numbers", "correction") or (row["study"] == "numbers"
                                                             and row["number"] in ("float", "double")):
            continue
        name = row["number"] if row["study"] == "numbers" else row["method"]
        x, y = float(row["ns"]), float(row["p999"])
        axes.scatter(x, y, color="black", marker="x" if row["study"] == "numbers" else "D", s=18, zorder=3)
        axes.annotate(name, (x, y), textcoords="offset points", xytext=(5, 3), fontsize=7)
    finish(axes, f"one root of one cell: {workload}", "time a root [ns], one lane",
           "p99.9 of the error [diagonals]", None)
    axes.set_ylim(top=1e3)
    axes.legend(fontsize=6, loc="upper center", ncol=2)


def draw_front(axes, rows):
    rows = [row for row in rows if row["workload"] == "coherent" and "filled" not in row["variant"]]
    curves = {}
    for row in rows:
        points = curves.setdefault(row["method"], {})
        n = int(row["n"])
        if n not in points or float(row["mrays_per_s"]) > float(points[n]["mrays_per_s"]):
            points[n] = row
    for method, points in curves.items():
        ordered = [points[n] for n in sorted(points)]
        x = [1e3 / float(row["mrays_per_s"]) for row in ordered]
        y = [float(row["surface_rms"]) for row in ordered]
        label = method if method in LEVELS else f"Embree, {method}"
        axes.plot(x, y, "D" if method in LEVELS else "o-", markersize=5, linewidth=1, label=label)
        for row, px, py in zip(ordered, x, y):
            if int(row["n"]):
                axes.annotate(row["n"], (px, py), textcoords="offset points", xytext=(5, 3), fontsize=7)
    finish(axes, f"{rows[0]['model']}, primary rays: patches and tessellations", "time a ray [ns]",
           "RMS distance to the surface [diagonals]")


def plot_study(rows, front, output):
    figure, axes = plt.subplots(3, 2, figsize=(12.5, 15))
    panels = list(axes.flat)
    if front:
        draw_front(panels[0], front)
    else:
        panels[0].remove()
    draw_levels(panels[1], rows)
    for panel, workload in zip(panels[2:], SOLVER_WORKLOADS):
        draw_solver(panel, rows, workload)
    draw_depth(panels[5], rows)
    figure.tight_layout()
    figure.savefig(output, dpi=75)


def draw_depth(axes, rows):
    rows = [row for row in rows if row["study"] == "depth" and row["workload"] == "random chords"]
    hits = max(float(row["n"]) for row in rows)
    for method in ("refined", "reference"):
        points = sorted((int(row["value"]), row) for row in rows if row["method"] == method
                        and row["value"].isdigit())
        x = [float(row["ns"]) for _, row in points]
        y = [max(float(row["lost"]) / hits, 1e-4) for _, row in points]
        axes.plot(x, y, "o-", markersize=4, linewidth=1, label=method)
        for (depth, _), px, py in zip(points, x, y):
            axes.annotate(str(depth), (px, py), textcoords="offset points", xytext=(4, 4), fontsize=7)
    finish(axes, "depth of the trees of sub-patches, random chords", "time a ray [ns]",
           "share of nearest hits lost (at the bottom: none)")


def plot_picture(rows, output):
    size = 1 + max(int(row["x"]) for row in rows)
    figure, axes = plt.subplots(1, len(LEVELS), figsize=(13, 3.9))
    norm = LogNorm(1e-18, 1e-6)
    for panel, level in zip(axes, LEVELS):
        image = np.full((size, size), np.nan)
        wrong = []
        for row in rows:
            x, y, error = int(row["x"]), int(row["y"]), float(row[level])
            if math.isinf(error):
                wrong.append((x, y))
            elif error >= 0:
                image[y, x] = max(error, 1e-18)
        shown = panel.imshow(image, norm=norm, cmap="viridis", interpolation="nearest")
        if wrong:
            panel.scatter(*zip(*wrong), s=6, color="red", linewidths=0)
        panel.set(title=f"{level}: {len(wrong)} wrong", xticks=[], yticks=[])
    figure.subplots_adjust(left=0.01, right=0.92, wspace=0.03)
    bar = figure.add_axes([0.935, 0.15, 0.012, 0.7])
    figure.colorbar(shown, cax=bar, label="distance from the true hit [diagonals]")
    figure.savefig(output, dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--study", help="CSV of bench/accuracy")
    parser.add_argument("--front", help="CSV of bench/front")
    parser.add_argument("--picture", help="CSV of bench/accuracy --picture")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    if arguments.picture:
        plot_picture(read(arguments.picture), arguments.output)
    elif arguments.study:
        plot_study(read(arguments.study), read(arguments.front) if arguments.front else None, arguments.output)
    else:
        parser.error("--study or --picture is needed")


if __name__ == "__main__":
    main()
