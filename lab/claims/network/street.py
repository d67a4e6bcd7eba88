"""C30, C31 and C33 to C35: images collected from vehicles on a street grid (Table 4.7, Figure 4.10).

The schemes' formulas are our reconstruction (SPEC 6.2) of Bruno & Nurchis, "Efficient data collection in
multimedia vehicular sensing platforms" (arXiv 1311.6013), of which only the abstract and the first lines were
available; the exhibits of the study state this.
"""

from __future__ import annotations

from collections.abc import Generator
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

from lab.claims.claim import Claim, Outcome
from lab.claims.exhibits import Table
from lab.claims.network.exhibits import caps_exhibits, figure_4_10, sizes_table
from lab.claims.network.intervals import interval
from lab.claims.network.study import (
    CAPPED_OBJECTS,
    CAPS,
    OBJECTS,
    RUNS,
    SCHEMES,
    STREET,
    Case,
    Found,
    mean,
    run_cases,
    street_study,
    values,
)
from packetmesh.progress import Progress

IMAGE_PX = (800, 600)
LARGE_BYTES = 30_000
LARGE_OBJECTS, LARGE_HORIZON_S = 10, 2700.0
MOST_SUMMARY_DIFFERENCE = 0.02
CROWDED = tuple(objects for objects in OBJECTS if objects >= 20)


def large_images(folder: Path, scheduler: str | None) -> Generator[Progress, None, Found]:
    """Run all schemes with images of 1,000 and 30,000 bytes, a quarter of an hour each after the warm-up."""
    sizes = (STREET.scheme.image_bytes, LARGE_BYTES)
    cases = [Case(scheme, LARGE_OBJECTS, None, size) for size in sizes for scheme in SCHEMES]
    return (yield from run_cases("C30, larger images", cases, folder, scheduler, LARGE_HORIZON_S))


def least_jpeg_bytes(width_px: int, height_px: int) -> int:
    """Return the size of a colour JPEG file of one grey, at the lowest quality and with optimal tables.

    OpenCV writes it as a baseline file with three channels; other JPEG files can be smaller.
    """
    image = np.full((height_px, width_px, 3), 128, np.uint8)
    options = [cv2.IMWRITE_JPEG_QUALITY, 1, cv2.IMWRITE_JPEG_OPTIMIZE, 1]
    return len(cv2.imencode(".jpg", image, options)[1])


def _c30(found: Found) -> Outcome:
    scheme = STREET.scheme
    least = least_jpeg_bytes(*IMAGE_PX)
    bit_per_px = 8.0 * scheme.image_bytes / (IMAGE_PX[0] * IMAGE_PX[1])
    parameters = (scheme.image_bytes, scheme.tag_bytes) == (1000, 40)
    small, large = (
        {name: mean(found, Case(name, LARGE_OBJECTS, None, size), "image_delivery_ratio") for name in SCHEMES}
        for size in (scheme.image_bytes, LARGE_BYTES)
    )
    ours = {"least_jpeg_bytes": float(least), "bit_per_px": bit_per_px}
    ours |= {f"delivery_ratio_{name}_1kB": share for name, share in small.items()}
    ours |= {f"delivery_ratio_{name}_30kB": share for name, share in large.items()}
    arrived = ", ".join(f"{name} {small[name]:.0%} and {large[name]:.0%}" for name in SCHEMES)
    return Outcome(
        ours,
        {},
        parameters and least <= scheme.image_bytes,
        f"the sizes are the preset's, as symbols: 1000 bytes are {bit_per_px:.3f} bit a pixel, and even a "
        f"grey area of 800 x 600 pixels takes {least:,} bytes as a baseline colour JPEG; of the images of "
        f"{LARGE_OBJECTS} vehicles these shares arrive with 1 and with 30 kB: {arrived}",
        (sizes_table(found, LARGE_OBJECTS, LARGE_HORIZON_S),),
    )


def _c31() -> Outcome:
    scheme = STREET.scheme
    rows = (
        ("images in a vehicle's buffer", 200, scheme.buffer_images, "scheme.buffer_images"),
        ("time between images, s", 2.0, scheme.sample_s, "scheme.sample_s"),
        ("validity of an image (T, here T_v), s", 10.0, scheme.validity_s, "scheme.validity_s"),
        ("observation period (T, here T_obs), s", 600.0, scheme.observation_s, "scheme.observation_s"),
        ("control period (S), s", 60.0, scheme.control_s, "scheme.control_s"),
        ("without a name; here r_L", 3.0, scheme.r_low, "scheme.r_low"),
        ("r_H", 8.0, scheme.r_high, "scheme.r_high"),
    )
    equal = sum(thesis == ours for _, thesis, ours, _ in rows)
    note = (
        "T stands for two parameters. The one without a name is most likely the low threshold that belongs "
        "to r_H: with S / T_v = 6 images a minute a cell is covered once, which lies between 3 and 8."
    )
    return Outcome(
        {name: float(ours) for _, _, ours, name in rows},
        {},
        equal == len(rows),
        f"{equal} of {len(rows)} values are the preset's; that the nameless 3 is r_L is our reading",
        (Table("Table 4.7", ("parameter", "thesis", "ours", "setting"), rows, note),),
    )


def _c33(found: Found) -> Outcome:
    run = STREET.run
    widths = {
        case: (interval(values(found, case, "images_per_minute"))[2] / mean_images - 1.0)
        for case in found
        if (mean_images := mean(found, case, "images_per_minute"))
    }
    widest = max(widths, key=lambda case: widths[case])
    complete = all(len(values(found, case, "images_per_minute")) == RUNS for case in found)
    return Outcome(
        {
            "horizon_s": run.horizon_s,
            "warmup_s": run.warmup_s,
            "runs": float(RUNS),
            "cases": float(len(found)),
            "largest_half_width": widths[widest],
        },
        {},
        (run.horizon_s, run.warmup_s) == (18_000.0, 1800.0) and complete,
        f"{len(found)} cases of {RUNS} runs of {run.horizon_s / 3600.0:g} h without their first "
        f"{run.warmup_s / 60.0:g} min; the 95 % intervals of images per minute are at most "
        f"± {widths[widest]:.1%} ({widest.scheme}, {widest.objects} vehicles)",
        figure_4_10(found)[-1:],
    )


def _c34(found: Found) -> Outcome:
    images, seen = (
        {(s, n): mean(found, Case(s, n), metric) for s in SCHEMES for n in OBJECTS}
        for metric in ("images_per_minute", "coverage")
    )
    grows = sum(all(images[s, a] < images[s, b] for a, b in pairwise(OBJECTS)) for s in SCHEMES)
    ordered = all(images["baseline", n] > images["pdc", n] >= images["greedy", n] for n in CROWDED)
    wider = sum(seen["greedy", n] > seen["baseline", n] for n in OBJECTS)
    share = max(images["greedy", n] / images["baseline", n] for n in CROWDED)
    kept = min(seen["greedy", n] / seen["baseline", n] for n in CROWDED)
    ours, ci95 = {}, {}
    for metric, means in (("images_per_minute", images), ("coverage", seen)):
        for (s, n), value in means.items():
            ours[f"{metric}_{s}_{n}"] = value
            ci95[f"{metric}_{s}_{n}"] = interval(values(found, Case(s, n), metric))[1:]
    most = OBJECTS[-1]
    return Outcome(
        ours,
        ci95,
        grows == len(SCHEMES) and ordered and wider == len(OBJECTS),
        f"from {OBJECTS[0]} to {most} vehicles images grow for {grows} of {len(SCHEMES)} schemes; BASELINE > "
        f"PDC ≥ GREEDY {'holds' if ordered else 'does not hold'} for {CROWDED[0]} and more; GREEDY covers "
        f"more than BASELINE with {wider} of {len(OBJECTS)} numbers of vehicles: from {CROWDED[0]} on it "
        f"collects at most {share:.0%} of BASELINE's images and covers at least {kept:.0%} of its windows; "
        f"of what cameras see BASELINE covers "
        f"{seen['baseline', most]:.0%} with {most} vehicles, GREEDY {seen['greedy', most]:.0%}, PDC "
        f"{seen['pdc', most]:.0%}",
        figure_4_10(found),
    )


def _c35(found: Found) -> Outcome:
    caps = {"unlimited" if k is None else str(k): Case("greedy", CAPPED_OBJECTS, k) for k in CAPS}
    images, requests, summaries = (
        [mean(found, case, metric) for case in caps.values()]
        for metric in ("images_per_minute", "request_bytes", "summary_bytes")
    )
    by_objects = [[mean(found, Case(s, n), "summary_bytes") for s in SCHEMES] for n in OBJECTS]
    spread = max(max(group) / min(group) - 1.0 for group in (*by_objects, summaries))
    grow = all(a <= b for group in (images, requests) for a, b in pairwise(group))
    ours, ci95 = {"summary_spread": spread}, {}
    for metric, means in (("images_per_minute", images), ("request_bytes", requests)):
        for (name, case), value in zip(caps.items(), means, strict=True):
            ours[f"{metric}_k_{name}"] = value
            ci95[f"{metric}_k_{name}"] = interval(values(found, case, metric))[1:]
    return Outcome(
        ours,
        ci95,
        grow and spread <= MOST_SUMMARY_DIFFERENCE,
        f"with {CAPPED_OBJECTS} vehicles k = {', '.join(caps)} gives "
        f"{', '.join(f'{value:.0f}' for value in images)} images and "
        f"{', '.join(f'{value:.0f}' for value in requests)} bytes of requests a minute; summaries differ by "
        f"{spread:.1%} at most between schemes and between values of k. The thesis's “signalling diminishes "
        "as k increases” contradicts its own reason, that k caps the ids of a request: it must read "
        "decreases",
        caps_exhibits(found),
    )


CLAIMS = (
    Claim(
        id="C30",
        claim="An image of 800 x 600 pixels, as JPEG, stays below 1000 bytes; its tag has 40",
        thesis="4.4: < 1000 B, 40 B, packets of 1000 B",
        tolerance="the preset's sizes, and some JPEG file of 800 x 600 pixels is that small; 30 kB is "
        "simulated, too",
        experiment=_c30,
        prepare=large_images,
    ),
    Claim(
        id="C31",
        claim="The parameters of the collection schemes",
        thesis="Table 4.7: 200; 2 s; 10 s; 600 s; 60 s; 3; 8",
        tolerance="the preset's own values, each under a name",
        experiment=_c31,
        by_definition=True,
    ),
    Claim(
        id="C33",
        claim="Five runs of 5 h, the first 30 min left out, with 95 % intervals",
        thesis="4.4: 5 h, 30 min, 5 runs, 95 %",
        tolerance="what the study does, with an interval for every case",
        experiment=_c33,
        prepare=street_study,
        by_definition=True,
    ),
    Claim(
        id="C34",
        claim="More objects, more images; GREEDY cuts the traffic and widens coverage, PDC cuts less",
        thesis="Fig. 4.10, 4.4: curves; GREEDY “widens coverage”",
        tolerance=(
            "images grow with the vehicles for every scheme; BASELINE > PDC ≥ GREEDY in images from 20 "
            "vehicles on; GREEDY covers more windows than BASELINE with every number of vehicles"
        ),
        experiment=_c34,
        prepare=street_study,
    ),
    Claim(
        id="C35",
        claim="A smaller k collects fewer images with less request traffic; summaries are the same for all",
        thesis="4.4, without numbers; “signalling diminishes as k increases”",
        tolerance="images and request bytes never fall as k grows (40 vehicles); summaries within 2 %",
        experiment=_c35,
        prepare=street_study,
    ),
)
