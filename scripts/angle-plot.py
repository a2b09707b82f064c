#!/usr/bin/env python3
"""One joint's angle over time in several motion archives, as an SVG: the counterpart of Fig. 11 of Wang, Chai, Xia 2018 (noisy, denoised, truth).

    angle-plot.py --joint right_knee [--clip NAME] [--from S] [--to S] noisy=noisy.h5 denoised=map.h5 truth=clean.h5 -o angle.svg

The angle is the component of the joint's local rotation vector along the axis that it turns about most in the last archive's clip (the truth's, as a rule), in degrees: signed, and smooth
through zero. Clips are found by name in every archive (default: the first clip of the first). The first curve is drawn as thin dots and line behind the others.
Exit status 2: usage; 3: a file, clip or joint that is not there. Needs h5py, NumPy.
"""
import argparse
from xml.sax.saxutils import escape

import h5py
import numpy as np
from motion_archive import fail, write_lines

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 900, 320, 56, 16, 34, 40
STYLES = [("#999999", "1", "none"), ("#0072b2", "2", "none"), ("#d55e00", "1.5", "7 3"), ("#009e73", "1.5", "2 3"), ("#cc79a7", "1.5", "9 3 2 3")]


def read(path, clip, joint):
    """Rotation vectors (T, 3), the rate, and the clip's name."""
    try:
        with h5py.File(path) as f:
            names = [n.decode() for n in f["clips/name"][()]]
            joints = [n.decode() for n in f["skeleton/joint_names"][()]]
            if joint not in joints:
                fail(f"{path}: no joint {joint}, expected one of {', '.join(joints)}")
            if not names:
                fail(f"{path}: 0 clips, expected at least one")
            clip = clip or names[0]
            if clip not in names:
                fail(f"{path}: no clip {clip}, expected one such as {names[0]}")
            i = names.index(clip)
            start, length = int(f["clips/start"][i]), int(f["clips/length"][i])
            q = f["frames/rotations"][start : start + length, joints.index(joint)].astype(float)
            rate = float(f.attrs["frame_rate_hz"])
    except OSError as e:
        fail(f"{path}: {e.strerror or 'cannot be read'}")
    except KeyError:
        fail(f"{path}: not a motion archive, expected what canonicalize or sample writes")
    q *= np.where(q[:, :1] < 0, -1, 1)
    length = np.linalg.norm(q[:, 1:], axis=1, keepdims=True)
    return q[:, 1:] * np.where(length > 1e-9, 2 * np.arctan2(length, q[:, :1]) / np.maximum(length, 1e-9), 2), rate, clip


def steps(low, high, most):
    """Round numbers between low and high, about `most`."""
    raw = max(high - low, 1e-9) / most
    size = 10.0 ** np.floor(np.log10(raw))
    size *= next(m for m in (1, 2, 5, 10) if m * size >= raw)
    return np.arange(np.ceil(low / size), np.floor(high / size) + 1) * size


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0], formatter_class=argparse.RawDescriptionHelpFormatter, epilog="\n".join(__doc__.split("\n")[1:]))
    parser.add_argument("curves", nargs="+", metavar="LABEL=ARCHIVE")
    parser.add_argument("--joint", required=True)
    parser.add_argument("--clip")
    parser.add_argument("--from", dest="begin", type=float, default=0.0, metavar="S")
    parser.add_argument("--to", dest="end", type=float, default=float("inf"), metavar="S")
    parser.add_argument("-o", "--output", required=True)
    o = parser.parse_args()
    if len(o.curves) > len(STYLES):
        fail(f"{len(o.curves)} curves, expected at most {len(STYLES)}", 2)
    data, clip, rate = [], o.clip, None
    for curve in o.curves:
        label, equals, path = curve.partition("=")
        if not equals or not label or not path:
            fail(f"{curve}: expected LABEL=ARCHIVE", 2)
        v, own, clip = read(path, clip, o.joint)
        if rate not in (None, own):
            fail(f"{path}: {own:g} Hz, expected {rate:g} Hz as in the first archive")
        rate = own
        data.append((label, v))
    axis = np.linalg.svd(data[-1][1], full_matrices=False)[2][0]
    if (data[-1][1] @ axis).sum() < 0:
        axis = -axis
    shown = []
    for label, v in data:
        t = np.arange(len(v)) / rate
        keep = (t >= o.begin - 1e-9) & (t <= o.end + 1e-9)
        shown.append((label, t[keep], np.degrees(v[keep] @ axis)))
    if min(len(t) for _, t, _ in shown) < 2:
        fail(f"fewer than 2 frames between {o.begin:g} s and {o.end:g} s of clip {clip}", 2)
    t0, t1 = shown[0][1][0], max(t[-1] for _, t, _ in shown)
    low, high = min(a.min() for *_, a in shown), max(a.max() for *_, a in shown)
    low, high = low - 0.05 * (high - low) - 0.5, high + 0.05 * (high - low) + 0.5
    x = lambda t: LEFT + (t - t0) / (t1 - t0) * (WIDTH - LEFT - RIGHT)
    y = lambda a: HEIGHT - BOTTOM - (a - low) / (high - low) * (HEIGHT - TOP - BOTTOM)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">', f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for a in steps(low, high, 6):
        out.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(a):.1f}" y2="{y(a):.1f}" stroke="#e5e5e5"/><text x="{LEFT - 6}" y="{y(a) + 4:.1f}" text-anchor="end">{a:g}</text>')
    for t in steps(t0, t1, 10):
        out.append(f'<line x1="{x(t):.1f}" x2="{x(t):.1f}" y1="{HEIGHT - BOTTOM}" y2="{HEIGHT - BOTTOM + 4}" stroke="black"/><text x="{x(t):.1f}" y="{HEIGHT - BOTTOM + 17}" text-anchor="middle">{round(t, 6):g}</text>')
    out.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{HEIGHT - BOTTOM}" y2="{HEIGHT - BOTTOM}" stroke="black"/>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 6}" text-anchor="middle">s</text><text x="14" y="{(TOP + HEIGHT - BOTTOM) / 2}" text-anchor="middle" transform="rotate(-90 14 {(TOP + HEIGHT - BOTTOM) / 2})">degrees</text>')
    out.append(f'<text x="{LEFT}" y="20" font-weight="bold">{escape(o.joint)}</text>')
    at = WIDTH - RIGHT
    for k, (label, t, a) in reversed(list(enumerate(shown))):
        at -= 8 * len(label) + 14
        colour, wide, dash = STYLES[k]
        out.append(f'<text x="{at + 6}" y="20">{escape(label)}</text><line x1="{at - 26}" x2="{at}" y1="16" y2="16" stroke="{colour}" stroke-width="{wide}" stroke-dasharray="{dash}"/>')
        at -= 30
    for k, (label, t, a) in enumerate(shown):
        colour, wide, dash = STYLES[k]
        points = " ".join(f"{x(s):.1f},{y(v):.1f}" for s, v in zip(t, a))
        out.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{wide}" stroke-dasharray="{dash}"/>')
        if k == 0 and len(shown) > 1:
            out.append(f'<g fill="{colour}">' + "".join(f'<circle cx="{x(s):.1f}" cy="{y(v):.1f}" r="1.8"/>' for s, v in zip(t, a)) + "</g>")
    out.append("</svg>")
    write_lines(o.output, out)


if __name__ == "__main__":
    main()
