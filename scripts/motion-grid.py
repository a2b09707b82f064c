#!/usr/bin/env python3
"""Many motions in one picture, an SVG: a cell for each clip with a few of its figures side by side, the counterpart of Fig. 7 to 9 of Motegi, Hijioka, Murakami 2018.

    motion-grid.py motions.h5 -o grid.svg [--columns 8] [--most 64] [--figures 5] [--names]

Figures are evenly spaced in time; seen from the side that the first frame of a clip shows its left to, in place. Left is blue, right orange.
Exit status 2: usage; 3: no archive, or one without clips. Needs h5py, NumPy.
"""
import argparse
from xml.sax.saxutils import escape

import h5py
import numpy as np
from motion_archive import fail, joint_positions, write_lines

CELL_W, CELL_H, TEXT = 150, 92, 12
COLOURS = {"left": "#0072b2", "right": "#d55e00", "": "#444444"}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0], formatter_class=argparse.RawDescriptionHelpFormatter, epilog="\n".join(__doc__.split("\n")[1:]))
    parser.add_argument("archive")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--columns", type=int, default=8)
    parser.add_argument("--most", type=int, default=64, help="clips drawn, the first of the archive")
    parser.add_argument("--figures", type=int, default=5)
    parser.add_argument("--names", action="store_true", help="write the clips' names")
    o = parser.parse_args()
    if min(o.columns, o.most, o.figures) < 1:
        fail("--columns, --most and --figures, expected numbers of at least 1", 2)
    try:
        with h5py.File(o.archive) as f:
            joints = [n.decode() for n in f["skeleton/joint_names"][()]]
            parents, offsets = f["skeleton/parents"][()], f["skeleton/rest_offsets"][()].astype(float)
            names = [n.decode() for n in f["clips/name"][: o.most]]
            starts, lengths = f["clips/start"][: o.most], f["clips/length"][: o.most]
            picks = [s + np.unique(np.linspace(0, n - 1, o.figures).round().astype(int)) for s, n in zip(starts, lengths)]
            rotations = [f["frames/rotations"][list(p)].astype(float) for p in picks]
    except OSError as e:
        fail(f"{o.archive}: {e.strerror or 'cannot be read'}")
    except KeyError:
        fail(f"{o.archive}: not a motion archive, expected what canonicalize or sample writes")
    if not names:
        fail(f"{o.archive}: 0 clips, expected at least one")
    with h5py.File(o.archive) as f:
        heights = [f["frames/root_position"][list(p), 2].astype(float) for p in picks]
    ground = CELL_H - 6
    scale = (CELL_H - (TEXT if o.names else 0) - 10) / 2.2  # an arm raised fits
    rows = -(-len(names) // o.columns)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {o.columns * CELL_W} {rows * CELL_H}" width="{o.columns * CELL_W}" height="{rows * CELL_H}" font-family="sans-serif" font-size="9" fill="none" stroke-linecap="round">',
           f'<rect width="{o.columns * CELL_W}" height="{rows * CELL_H}" fill="white"/>']
    for k, (name, q, z) in enumerate(zip(names, rotations, heights)):
        x0, y0 = k % o.columns * CELL_W, k // o.columns * CELL_H
        out.append(f'<path d="M{x0 + 4} {y0 + ground}h{CELL_W - 8}" stroke="#cccccc"/>')
        if o.names:
            out.append(f'<text x="{x0 + 5}" y="{y0 + 10}" fill="black">{escape(name)}</text>')
        heading = 2 * np.arctan2(q[0, 0, 3], q[0, 0, 0])
        places = joint_positions(parents, offsets, q, np.stack([0 * z, 0 * z, z], 1))
        side = [np.cos(heading) * v[:, 0] + np.sin(heading) * v[:, 1] for v in places]
        for t in range(len(z)):
            at = lambda j: (x0 + (t + 0.5) * CELL_W / o.figures + scale * side[j][t], y0 + ground - scale * places[j][t, 2])
            lines = {"left": "", "right": "", "": ""}
            for j, p in enumerate(parents):
                if p >= 0:
                    (ax, ay), (bx, by) = at(p), at(j)
                    lines[next((s for s in ("left", "right") if joints[j].startswith(s)), "")] += f"M{ax:.1f} {ay:.1f}L{bx:.1f} {by:.1f}"
            for s in ("right", "", "left"):
                out.append(f'<path d="{lines[s]}" stroke="{COLOURS[s]}" stroke-width="1.4"/>')
            if "head" in joints:
                hx, hy = at(joints.index("head"))
                out.append(f'<circle cx="{hx:.1f}" cy="{hy - 0.08 * scale:.1f}" r="{0.09 * scale:.1f}" fill="{COLOURS[""]}"/>')
    out.append("</svg>")
    write_lines(o.output, out)


if __name__ == "__main__":
    main()
