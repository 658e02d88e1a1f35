"""Opens a pyramid with zarr-python, decodes it with the shared tile rule, and prints what it found as JSON.

    python read_pyramid.py PYRAMID.zarr FOLDER_OF_TILE_RULE

Checks on the way: every array opens, every record of every level decodes, the tiles of a level agree on their
shared borders, and the finest level's records give the heights that are printed.
"""
import json
import sys

import numpy as np
import zarr

pyramid, rule = sys.argv[1:3]
sys.path.insert(0, rule)
import tile_rule  # noqa: E402  (the shared rule is found only now)

root = zarr.open_group(pyramid, mode="r")
about = dict(root.attrs)
about = about.get("drumlin", about)
levels, grid = about["levels"], about["grid"]
KINDS = {1: "<i1", 2: "<i2", 4: "<i4"}


def parts(level, record):
    """The numbers of a record, as FORMAT.md lays them out; the id and the summaries come first."""
    fixed = 1024 + (2081 if level["voids"] else 0) + 1225 * level["cage_bytes"] + 16641 * level["detail_bytes"]
    at = len(record) - fixed + 1024
    voids = None
    if level["voids"]:
        voids = np.unpackbits(record[at:at + 2081], bitorder="little")[:16641].reshape(129, 129)
        at += 2081
    cage = np.frombuffer(record[at:].tobytes(), KINDS[level["cage_bytes"]], 1225).astype(np.int64).reshape(35, 35)
    at += 1225 * level["cage_bytes"]
    detail = np.frombuffer(record[at:].tobytes(), KINDS[level["detail_bytes"]], 16641).reshape(129, 129)
    return voids, cage, detail


controls, tiles, samples = {}, 0, []
for number, level in enumerate(levels):
    array = root[f"tile/{number}"]
    assert array.shape[:2] == tuple(level["tiles"]), (number, array.shape)
    heights = {}
    for row in range(level["tiles"][0]):
        for column in range(level["tiles"][1]):
            voids, cage, detail = parts(level, array[row, column])
            if not level["key"]:
                parent = controls[number - 1, row // 2, column // 2]
                cage = tile_rule.child_window(parent, row % 2, column % 2) + level["step"] * cage
            controls[number, row, column] = cage
            h = tile_rule.decode(cage, detail, level["step"])
            if (row, column - 1) in heights:
                assert np.array_equal(heights[row, column - 1][:, 128], h[:, 0]), (number, row, column)
            if (row - 1, column) in heights:
                assert np.array_equal(heights[row - 1, column][128], h[0]), (number, row, column)
            heights[row, column] = h
            tiles += 1
            if number == len(levels) - 1 and (row + column) % 3 == 0:
                i, j = (7 * row + 31) % 128, (11 * column + 57) % 128
                y, x = 128 * row + i, 128 * column + j
                if y < grid["rows"] and x < grid["columns"] and (voids is None or not voids[max(i - 1, 0):i + 2, max(j - 1, 0):j + 2].any()):
                    samples.append({
                        "x": grid["origin"][0] + x * grid["step"][0],
                        "y": grid["origin"][1] + y * grid["step"][1],
                        "height": float(h[i, j]) * 2.0 ** about["unit_exponent"],
                    })
print(json.dumps({"tiles": tiles, "samples": samples}))
