#!/usr/bin/env python3
"""Assembles the table of scripts/refinement.mk from the figures that it leaves in a folder.

    refinement-table.py FOLDER

Reads FOLDER/figures-ROW.json (fid-eval --json), FOLDER/compared-ROW.json (motion-compare --json) and the logs of the refiners' trainings; writes table.md and table.tsv there: all motion,
then each value of the attribute. Exit status 3 names a file that is missing or not what it should be.
"""
import statistics
import sys
from pathlib import Path

from tool_json import fail, read

ROWS = [("mocap", "captured"), ("generated", "generated"), ("plain", "refined, blind to contacts"), ("contacts", "refined, with contacts")]
LAST = 200  # updates of the training over which the discriminator's accuracy is told
# column, figure of fid-eval, digits, of real, for each value
COLUMNS = [("skate m/s", "skate_mps", 3, False, True), ("skate ratio", "skate_gmd", 3, False, True), ("speed in contact m/s", "contact_speed_mps", 3, False, True),
           ("height in contact mm", "contact_height_m", 1, False, True), ("penetration mm", "penetration_m", 2, False, True), ("jerk, of real", "jerk", 2, True, True), ("FID", "fid", 1, False, False),
           ("KID", "kid", 3, False, False)]


def accuracy(path):
    """How often the discriminator was right in the end: of refined and of real windows together."""
    try:
        lines = path.read_text().splitlines()
        columns = lines[0].split("\t")
        at = [columns.index(c) for c in ("accuracy_refined", "accuracy_real")]
        return statistics.fmean(float(line.split("\t")[i]) for line in lines[1:][-LAST:] for i in at)
    except (OSError, ValueError, IndexError, statistics.StatisticsError) as e:
        fail(f"{path}: {e}, expected the log of train-refiner")


def main():
    if len(sys.argv) != 2:
        fail("usage: refinement-table.py FOLDER")
    folder = Path(sys.argv[1])
    names = [(row + end, title + words) for row, title in ROWS for end, words in (("", ""), ("-pinned", ", pinned"))]
    figures = {row: read(folder / f"figures-{row}.json", "fid.value") for row, _ in names}
    compared = {row: read(folder / f"compared-{row}.json", "rows") for row, _ in names}
    right = {row: accuracy(folder / f"refiner-{row}.h5.log.tsv") for row in ("plain", "contacts")}
    tsv = ["row\tof\tfigure\tvalue\tlow\thigh"]

    def cell(row, of, figure, digits, of_real, suffix=""):
        document, name = figures[row], figure + ("" if of == "all" else "." + of)
        value = document.get(name + suffix + ".value")
        if value is None:
            return "-"
        scale = 1000 if figure.endswith("_m") else 1
        if of_real:
            real = document.get(name + ".real.value")
            if not real:
                return "-"
            value, scale = value / real, 1
        tsv.append("\t".join([row if not suffix else "test", of, figure, f"{value:.6g}"] + [f"{document[f'{name}{suffix}.{side}']:.6g}" if not of_real and document.get(f"{name}{suffix}.{side}") is not None else ""
                                                                                       for side in ("low", "high")]))
        return f"{value * scale:.{digits}f}"

    def ratio(row, of, key):
        both = {r["set"]: r for r in compared[row]["rows"] if r["group"] == of}
        if "real" not in both or "generated" not in both or not both["real"][key]:
            return "-"
        value = both["generated"][key] / both["real"][key]
        tsv.append(f"{row}\t{of}\t{key}_of_input\t{value:.6g}\t\t")
        return f"{value:.3f}"

    def table(of, columns, last):
        head = ["of " + of if of != "all" else "", "energy, of input", "root's speed, of input"] + [c for c, *_ in columns] + last
        lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
        for row, title in names:
            cells = [title] + [ratio(row, of, key) for key in ("energy", "root_speed_mps")] + [cell(row, of, figure, digits, of_real) for _, figure, digits, of_real, _ in columns]
            if last:
                cells.append(f"{right[row]:.2f}" if row in right else "-")
                if row in right:
                    tsv.append(f"{row}\tall\tdiscriminator_accuracy\t{right[row]:.6g}\t\t")
            lines.append("| " + " | ".join(cells) + " |")
        cells = ["test clips", "-", "-"] + [cell("generated", of, figure, digits, of_real, ".real") if not of_real else "1" for _, figure, digits, of_real, _ in columns] + ["-"] * len(last)
        return "\n".join(lines + ["| " + " | ".join(cells) + " |", ""])

    values = sorted({r["group"] for r in compared["generated"]["rows"]} - {"all"})
    md = table("all", COLUMNS, ["discriminator right"])
    for value in values:
        md += "\n" + table(value, [c for c in COLUMNS if c[4]], [])
    (folder / "table.md").write_text(md)
    (folder / "table.tsv").write_text("\n".join(tsv) + "\n")


main()
