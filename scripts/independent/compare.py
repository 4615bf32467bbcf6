"""Runs the cases, prints and writes the table. Ends with 1 where both render the same model and differ by more than noise."""
import argparse
import os
import time
from pathlib import Path

import numpy as np

import cases
from canopy import Canopy

# A difference is one where it is this many of its standard errors and this large. With eight seeds on either side, one run of
# seventy rows in seventy has one by chance.
SIGMAS, LEAST = 5.0, 0.2


def mean_and_error(images):
    """Mean of the image and its standard error by the spread of seeds, channel by channel."""
    seeds = images.mean((1, 2))
    return seeds.mean(0), seeds.std(0, ddof=1) / np.sqrt(len(seeds))


def lines(row):
    """Rows of the table, one a channel, each with whether it is beyond noise."""
    (a, ea), (b, eb) = mean_and_error(row.canopy), mean_and_error(row.other)
    for channel in range(len(a)):
        difference = 100 * (a[channel] / b[channel] - 1)
        error = 100 * np.hypot(ea[channel] / a[channel], eb[channel] / b[channel])
        beyond = row.same and abs(difference) > max(SIGMAS * error, LEAST)
        name = row.name + (", " + "RGB"[channel] if len(a) > 1 else "")
        noise = "%.2f" % (3 * error) if row.same else "(model)"
        yield "| %s | %.5g | %.5g | %+.2f | %s |%s" % (name, a[channel], b[channel], difference, noise, " **beyond noise**" if beyond else ""), beyond


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--probe", type=Path, required=True, help="examples/probe, built")
    parser.add_argument("--out", type=Path, required=True, help="folder for the table and for scenes")
    parser.add_argument("--samples", type=float, default=1.0, help="factor on the samples")
    parser.add_argument("--cases", default=",".join(cases.CASES), help="some of the cases, by commas")
    parser.add_argument("--list", action="store_true", help="names the cases")
    arguments = parser.parse_args()
    if arguments.list:
        for name, case in cases.CASES.items():
            print("%-10s %s" % (name, case.__doc__))
        return 0
    names = arguments.cases.split(",")
    unknown = [name for name in names if name not in cases.CASES]
    if unknown:
        parser.error("there is no case %s; there are %s" % (", ".join(unknown), ", ".join(cases.CASES)))
    trees = Path(os.environ.get("CANOPY_DATA", ""), "trees")
    folder = arguments.out / "scenes"
    folder.mkdir(parents=True, exist_ok=True)
    bench = cases.Bench(Canopy(arguments.probe), folder, trees, arguments.samples)
    table = ["| case | Canopy | Mitsuba | difference, % | three standard errors, % |", "|---|--:|--:|--:|--:|"]
    print("\n".join(table), flush=True)
    wrong = 0
    for name in names:
        if name in cases.NEED_TREES and not (trees / "oak-medium.glb").exists():
            print("%s: skipped. CANOPY_DATA must name a folder with trees/oak-medium.glb and trees/aspen-medium.glb." % name)
            continue
        started = time.monotonic()
        for row in cases.CASES[name](bench):
            for line, beyond in lines(row):
                print(line, flush=True)
                table.append(line)
                wrong += beyond
        print("%s: %.0f s" % (name, time.monotonic() - started), flush=True)
    (arguments.out / "table.md").write_text("\n".join(table) + "\n")
    print("%d rows are beyond noise. The table is in %s." % (wrong, arguments.out / "table.md"))
    return int(wrong > 0)


if __name__ == "__main__":
    raise SystemExit(main())
