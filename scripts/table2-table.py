#!/usr/bin/env python3
"""Assembles Table 2 of Ghorbani et al. 2020 from the figures that scripts/table2.mk leaves in a folder.

    table2-table.py FOLDER --models M ... --seeds S ... --judges J ...

Reads FOLDER/figures-MODEL-SEED-JUDGE.json (fid-eval --json); writes table.md, table.tsv and table.tex there, the model's figures and below them (not in table.tex) those of each
value of the attribute that fid-eval --by had. With several seeds: the median
over seeds and judges' mean, and in brackets the smallest and largest seed; with one seed the means over judges of the value and of
the ends of its 95 % interval. Exit status 3 names a file that is missing or not what fid-eval writes.
"""
import argparse
import statistics
from pathlib import Path

from tool_json import read

NAMES = {"motion-cell": "Proposed", "single-layer": "Proposed (SL)", "uniform-joints": "Proposed (NL)", "no-classifier": "Proposed (NC)", "quaternet": "QuaterNet", "erd": "ERD"}
ORDER = ["erd", "quaternet", "single-layer", "uniform-joints", "no-classifier", "motion-cell"]  # the paper's
# column, figure, digits
COLUMNS = [("IS", "is", 3), ("FID test", "fid", 1), ("FID train", "fid.train", 1), ("precision", "precision", 2), ("recall", "recall", 2),
           ("variance in a class, of real", "within_class_variance", 2), ("energy, of real", "energy", 2), ("jerk, of real", "jerk", 2), ("frozen", "frozen_share", 3), ("skate m/s", "skate_mps", 3),
           ("nearest training", "nearest_training", 3)]
# The same for each value: energy and jerk are those of the joints, skate that of toes in contact.
BY_VALUE = [("energy, of real", "energy", 2), ("variance in a class, of real", "within_class_variance", 2), ("jerk, of real", "jerk", 2), ("skate, of real", "skate_mps", 2), ("frozen", "frozen_share", 3)]
OF_REAL = {"within_class_variance", "energy", "jerk"}


def value(document, figure, field="value", of_real=None):
    found = document.get(f"{figure}.{field}")
    if found is None or not (figure in OF_REAL if of_real is None else of_real):
        return found
    real = document.get(f"{figure}.real.value")
    return found / real if real else None


def mean(values):
    values = [v for v in values if v is not None]
    return statistics.fmean(values) if values else None


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    for name in ("models", "seeds", "judges"):
        parser.add_argument("--" + name, nargs="+", required=True)
    a = parser.parse_args()
    figures = {(m, s, j): read(a.folder / f"figures-{m}-{s}-{j}.json", "fid.value") for m in a.models for s in a.seeds for j in a.judges}

    everything = list(figures.values())
    judged = sorted({key[:-len(".value")] for d in everything for key in d if key.startswith("accuracy.") and key.endswith(".value")})
    columns = COLUMNS[:1] + [("accuracy, " + name.split(".", 1)[1], name, 3) for name in judged if not name.endswith(".real")] + COLUMNS[1:]
    tsv = ["model\tfigure\tvalue\tlow\thigh"]

    def cell(model, figure, digits, of_real=None):
        seeds = [v for v in (mean([value(figures[model, s, j], figure, "value", of_real) for j in a.judges]) for s in a.seeds) if v is not None]
        if not seeds:
            return "-"
        middle = statistics.median(seeds)
        if len(seeds) > 1:
            low, high = min(seeds), max(seeds)
        else:
            low, high = (mean([value(figures[model, a.seeds[0], j], figure, side, of_real) for j in a.judges]) for side in ("low", "high"))
        tsv.append(f"{model}\t{figure}\t{middle:.6g}\t" + "\t".join("" if x is None else f"{x:.6g}" for x in (low, high)))
        return f"{middle:.{digits}f}" + (f" [{low:.{digits}f}, {high:.{digits}f}]" if low is not None and high is not None else "")

    models = [m for m in ORDER if m in a.models] + [m for m in a.models if m not in ORDER]
    rows = [[NAMES.get(m, m)] + [cell(m, figure, digits) for _, figure, digits in columns] for m in models]

    # What does not depend on the model. Real clips are cut to the generated clips' lengths, so floors differ a little from model to model: the mean.
    real = {name[:-len(".real")]: name for name in judged if name.endswith(".real")} | {"is": "is.real", "skate_mps": "skate_mps.real", "frozen_share": "frozen_share.real", "nearest_training": "nearest_training.real",
            "fid": "fid.floor_halves", "fid.train": "fid.floor_train"}
    cells = []
    for _, figure, digits in columns:
        key = real.get(figure)
        v = 1.0 if figure in OF_REAL else mean([d.get(key + ".value") for d in everything]) if key else None
        cells.append("-" if v is None else f"{v:.{digits}f}")
        if v is not None:
            tsv.append(f"real\t{figure}\t{v:.6g}\t\t")
    frozen = mean([d.get("fid.mean_pose.value") for d in everything])
    if frozen is not None:
        rows.append(["Training clips frozen in their class's mean pose"] + [f"{frozen:.{digits}f}" if figure == "fid" else "-" for _, figure, digits in columns])
        tsv.append(f"mean-pose\tfid\t{frozen:.6g}\t\t")
    rows.append(["Real data (FID: halves of test; train against test)"] + cells)

    head = ["model"] + [c for c, _, _ in columns]
    spread = "smallest and largest of the seeds" if len(a.seeds) > 1 else "95 % intervals"
    note = f"{'Medians of seeds' if len(a.seeds) > 1 else 'Seed'} {', '.join(a.seeds)}, means of judges {', '.join(a.judges)}; in brackets {spread}. IS of at most {everything[0].get('is.bound.value', 0):.0f}."
    values = sorted({key[len("energy."):-len(".value")] for d in everything for key in d if key.startswith("energy.") and key.endswith(".value") and not key.endswith(".real.value")} - {"real", ""})
    by = [[NAMES.get(m, m), v] + [cell(m, f"{figure}.{v}", digits, figure != "frozen_share") for _, figure, digits in BY_VALUE] for v in values for m in models]

    def markdown(head, rows):
        return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] + ["| " + " | ".join(r) + " |" for r in rows] + [""])

    md = markdown(head, rows) + "\n" + note + "\n"
    if by:
        md += "\n" + markdown(["model", "of"] + [c for c, _, _ in BY_VALUE], by)
    tex = ["\\begin{tabular}{l" + "r" * len(columns) + "}", "\\hline", " & ".join(head) + " \\\\", "\\hline"] + [" & ".join(r) + " \\\\" for r in rows] + ["\\hline", "\\end{tabular}", ""]
    (a.folder / "table.md").write_text(md)
    (a.folder / "table.tsv").write_text("\n".join(tsv) + "\n")
    (a.folder / "table.tex").write_text("\n".join(tex))


main()
