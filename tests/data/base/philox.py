#!/usr/bin/python3
"""Writes philox.tsv: words of Philox4x32-10 (Salmon et al., SC'11) computed from the paper's definition.

Columns: seed, stream, position of the first word, eight words. Counter = (block index, stream), key = seed.
The definition below is first held against the known-answer vectors of the Random123 distribution."""
import os

M32 = 0xFFFFFFFF


def philox4x32_10(counter, key):
    c, k = list(counter), list(key)
    for _ in range(10):
        p0, p1 = 0xD2511F53 * c[0], 0xCD9E8D57 * c[2]
        c = [(p1 >> 32) ^ c[1] ^ k[0], p1 & M32, (p0 >> 32) ^ c[3] ^ k[1], p0 & M32]
        k = [(k[0] + 0x9E3779B9) & M32, (k[1] + 0xBB67AE85) & M32]
    return c


KNOWN = [
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((M32,) * 4, (M32,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    ((0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344), (0xA4093822, 0x299F31D0), (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1)),
]
for counter, key, expected in KNOWN:
    assert tuple(philox4x32_10(counter, key)) == expected

with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "philox.tsv"), "w") as out:
    for seed, stream, position in [(0, 0, 0), (1, 0, 0), (1, 17, 0), (0x299F31D0A4093822, 0x0370734413198A2E, 5),
                                   (2**64 - 1, 2**64 - 1, 2**40 + 3), (42, 2**32, 2**63)]:
        words = []
        for n in range(position, position + 8):
            index = n // 4
            block = philox4x32_10((index & M32, index >> 32, stream & M32, stream >> 32), (seed & M32, seed >> 32))
            words.append(block[n % 4])
        out.write("\t".join(map(str, [seed, stream, position, *words])) + "\n")
