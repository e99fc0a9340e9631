#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Plots CSV files of bench/front: error against time a ray, one panel a workload, the area of a mark grows with memory.

usage: plot_front.py FILE.csv [FILE.csv ...] [-o FRONT.png] [--markdown FRONT.md]
"""
import argparse
import csv
import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter


def best_by_method(rows):
    """The fastest variant of every method; rays that are filled within the timing are another question and left out."""
    best = {}
    for row in rows:
        if "filled" in row["variant"] or float(row["surface_rms"]) <= 0:
            continue
        key = (row["method"], int(row["n"]))
        if key not in best or float(row["mrays_per_s"]) > float(best[key]["mrays_per_s"]):
            best[key] = row
    return best


def draw(axes, rows, title):
    best = best_by_method(rows)
    for method in sorted({name for name, _ in best}, key=lambda m: (m in ("triangles", "grid"), m)):
        points = sorted((n, row) for (name, n), row in best.items() if name == method)
        x = [1e3 / float(row["mrays_per_s"]) for _, row in points]
        y = [float(row["surface_rms"]) for _, row in points]
        size = [20 + 40 * math.log2(1 + float(row["bytes"]) / 2**16) for _, row in points]
        meshed = method in ("triangles", "grid")
        label = f"Embree, {method}" if meshed else method
        line = axes.plot(x, y, "-" if meshed else "", linewidth=1)[0]
        axes.scatter(x, y, s=size, color=line.get_color(), alpha=0.7, label=label, marker="o" if meshed else "D")
        for (n, _), px, py in zip(points, x, y):
            left = method == "triangles"
            axes.annotate(str(n) if n else method, (px, py), textcoords="offset points", fontsize=7,
                          xytext=(-9, -9) if left else (9, 5), ha="right" if left else "left")
    axes.set(xscale="log", yscale="log", title=title, xlabel="time a ray [ns], one thread",
             ylabel="RMS distance to the exact surface\n[bounding-box diagonals]")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="both", linewidth=0.3)
    axes.legend(fontsize=8, markerscale=0.5)


def markdown(rows):
    """One workload as a table: every method's rate by variant, with its memory, build time and errors."""
    variants = list(dict.fromkeys(row["variant"] for row in rows))
    lines = [f"| method | N | build s | MiB | {' | '.join(variants)} | RMS | max | wrong |",
             "|---" * (7 + len(variants)) + "|"]
    methods = {}
    for row in rows:
        methods.setdefault((row["method"], int(row["n"])), {})[row["variant"]] = row
    for (method, n), by_variant in methods.items():
        row = next(iter(by_variant.values()))
        rates = [f"{float(by_variant[v]['mrays_per_s']):.2f}" if v in by_variant else "" for v in variants]
        errors = [f"{float(row[e]):.1e}" if float(row[e]) else "" for e in ("surface_rms", "surface_max")]
        memory = float(row["bytes"]) / 2**20
        build = float(row["build_seconds"])
        lines.append(f"| {method} | {n or ''} | {build:.4f} | {memory:.3f} | {' | '.join(rates)} | "
                     f"{' | '.join(errors)} | {row['wrong']} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("csv", nargs="+")
    parser.add_argument("-o", "--output", help="picture")
    parser.add_argument("--markdown", help="the same figures as tables")
    arguments = parser.parse_args()
    panels = []
    for name in arguments.csv:
        with open(name, newline="") as file:
            rows = list(csv.DictReader(file))
        for workload in dict.fromkeys(row["workload"] for row in rows):
            chosen = [row for row in rows if row["workload"] == workload]
            rays = int(chosen[0]["rays"])
            panels.append((chosen, f"{chosen[0]['model']}, {workload}: {rays} rays"))
    if arguments.markdown:
        with open(arguments.markdown, "w") as file:
            file.write("\n\n".join(f"{title}\n\n{markdown(rows)}" for rows, title in panels) + "\n")
    if arguments.output:
        plot(panels, arguments.output)


def plot(panels, output):
    panels = [(rows, title) for rows, title in panels if best_by_method(rows)]
    height = math.ceil(len(panels) / 2)
    figure, axes = plt.subplots(height, 2, figsize=(13, 5.5 * height), squeeze=False)
    for ax, (rows, title) in zip(axes.flat, panels):
        draw(ax, rows, title)
    for ax in list(axes.flat)[len(panels):]:
        ax.remove()
    figure.suptitle("Error, time and memory of exact patches and of tessellations "
                    "(numbers: cells per patch edge; area of a mark: memory)", fontsize=10)
    figure.tight_layout()
    figure.savefig(output, dpi=130)


if __name__ == "__main__":
    main()
