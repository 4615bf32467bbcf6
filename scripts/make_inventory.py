#!/usr/bin/env python3
"""Makes assets/inventories/mixed_stand.csv, the inventory of assets/scenes/inventory.ron.

A mixed stand of beech and spruce on 200 m x 200 m, invented, not measured, but with the habits of a real one:
stems keep a distance that grows with their size, spruces stand in groups, heights follow from the diameters
(Petterson 1955: h = 1.3 + (d / (a + b d))^3) with some scatter. Everything comes from one integer hash
(SplitMix64, Steele, Lea and Flood 2014), so that the file is the same wherever it is made.

Usage: python3 scripts/make_inventory.py > assets/inventories/mixed_stand.csv
"""

import math

SIZE_M = 200.0
TREES = 600
MASK = (1 << 64) - 1
# Petterson's a and b for diameters in cm and heights in m, typical of older stands of middling sites.
PETTERSON = {"Fagus sylvatica": (1.75, 0.304), "Picea abies": (2.05, 0.296)}


def uniform(stream, index):
    """A number in [0, 1) for each stream and index."""
    z = (stream * 0xD1342543DE82EF95 + (index + 1) * 0x9E3779B97F4A7C15) & MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return ((z ^ (z >> 31)) >> 11) / float(1 << 53)


def normal(stream, index):
    """A standard normal deviate (Box and Muller 1958)."""
    radius = math.sqrt(-2.0 * math.log(1.0 - uniform(stream, 2 * index)))
    return radius * math.cos(2.0 * math.pi * uniform(stream, 2 * index + 1))


def spruce_share(x, y):
    """Spruces fill the north-east and some groups elsewhere."""
    slope = (x + y) / (2.0 * SIZE_M)
    groups = 0.5 + 0.5 * math.sin(0.071 * x + 1.3) * math.sin(0.083 * y + 0.4)
    return min(1.0, max(0.0, 1.6 * slope * groups + 0.15 * groups))


def height(species, dbh):
    a, b = PETTERSON[species]
    return 1.3 + (dbh / (a + b * dbh)) ** 3


def main():
    trees = []
    attempt = 0
    while len(trees) < TREES:
        x, y = SIZE_M * uniform(1, attempt), SIZE_M * uniform(2, attempt)
        species = "Picea abies" if uniform(3, attempt) < spruce_share(x, y) else "Fagus sylvatica"
        dbh = min(82.0, max(8.0, 33.0 * math.exp(0.38 * normal(4, attempt))))
        tall = height(species, dbh) * (1.0 + 0.06 * normal(5, attempt))
        attempt += 1
        room = 1.4 + 0.045 * dbh
        near = ((x - u) ** 2 + (y - v) ** 2 < (0.5 * (room + 1.4 + 0.045 * d)) ** 2 for u, v, d, _, _ in trees)
        if not any(near):
            trees.append((x, y, dbh, tall, species))
    trees.sort(key=lambda tree: (tree[1], tree[0]))
    print("x_m,y_m,dbh_cm,height_m,species")
    for x, y, dbh, tall, species in trees:
        print(f"{x:.2f},{y:.2f},{dbh:.1f},{tall:.1f},{species}")


if __name__ == "__main__":
    main()
