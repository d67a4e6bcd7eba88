"""The tables of docs/results.md, one function per record: from its numbers to Markdown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lab.results.markdown import Cell, Row, change, exhibit, listed, percent, pivot, table, text

METHODS = (
    *("icp", "picp", "ricp", "mricp", "ficp", "hicp", "icp-gated", "icp-gated plane", "pixel-pairs"),
    *("ceicp-n", "ceicp-a", "ceicp-a plane", "fast-robust-icp plane", "open3d-gicp", "small-gicp-staged"),
)
"""The thesis's rivals, ICP with a gate, pixel pairs, CEICP and its closest competitors; the report of
`reproduce` has all methods."""
_FRAME_SHARES = ("within_2pct", "within_5pct", "no_hit")
DIRECTIONS = {"q2p": "source to target (q2p)", "p2q": "target to source (p2q)"}
OURS = "ceicp-a"
SHOWN = (
    ("C12", "Errors of inferred depth, median-scaled"),
    ("C14", ""),
    ("C16", "One node, all six conditions: ceicp-a"),
    ("C16", "Two nodes"),
    ("C17", "Ablations"),
    ("C21", "The printed radii"),
    ("C22", "Rays that find nothing"),
    ("C23", "Stairs"),
    ("C24", "Time and storage"),
    ("C28", "Table 4.6"),
    ("C32", "Saturated throughput, with an EIFS"),
    ("C34", "Figure 4.10 in numbers"),
    ("C35", "GREEDY"),
    ("C36", "F(S)"),
    ("D01", "One per cent of lost packets"),
    ("D01", "Until everything has arrived"),
    ("D01", "What is left after losses"),
    ("D07", "What each sixteenth"),
    ("D08", "F-score of some"),
    ("D10", "Confidence in bins"),
)
"""Claim and beginning of the title, for each table of a claim that the page shows."""


def reconstructions(numbers: Row) -> str:
    """Return the chain's results on every scene, before and after fusion."""
    rows = []
    for scene, presets in numbers.items():
        for preset, run in presets.items():
            before, after, measured = run["surface_before"], run["surface_after"], run["measured"]
            scores = f_scores(run)
            areas = f"{before['hole_area_m2']:.2f} → {after['hole_area_m2']:.2f} m²"
            rows.append(
                (
                    *(scene, preset, change(before["no_hit_ray_share"], after["no_hit_ray_share"])),
                    change(*scores) if scores else None,
                    change(measured["within_2pct_before"], measured["within_2pct_after"]),
                    areas,
                )
            )
    header = (
        *("scene", "preset", "rays without a surface", "F-score at 5 cm"),
        *("measured pixels kept", "holes' area"),
    )
    return f"""Before → after fusion. *Rays without a surface*: of all pixels of all cameras. *F-score at
5 cm*: of mesh and truth, where there is a truth. *Measured pixels kept*: the surface lies within 2 % of what
the sensor measured there. *Holes' area*: of all boundary loops together; inferred surface has small holes of
its own, so that it can grow while rays without a surface become fewer.

{table(header, rows)}

What fills a hole is a guess, and fewer missing rays do not show that it is right. The F-score shows it, and
falls in {_falls(numbers)}."""


def real_frames(numbers: Row) -> str:
    """Return results on real frames not used for training or tuning, before and after fusion."""
    header = (
        *("frames", "number", "measured pixels the filter keeps", "within 2 % of the measurement"),
        *("within 5 %", "rays without a surface", "rays that guesses close", "frames where a share fell"),
    )
    rows = [
        (
            *(name, found["frames"], percent(found["kept_share"], 2)),
            *(change(found[f"{key}_before"], found[f"{key}_after"]) for key in _FRAME_SHARES),
            *(percent(found["guessed_ray_share"]), found["lower_after"]),
        )
        for name, found in numbers.items()
    ]
    lower, frames = (sum(found[key] for found in numbers.values()) for key in ("lower_after", "frames"))
    return f"""Before → after fusion by the preset `packetmesh`, means over the frames; no truth is needed.
*Within*: of the measured pixels, those whose ray meets the surface within this share of the measurement. No
network was trained on any of these frames. The desk and the basket are Kinect frames, `sr300` frames of a
RealSense SR300 in Debian's visp-images-data, `middlebury` the motorcycle in the wheel of scikit-image 0.17.2;
`PACKETMESH_DEPTH_SETS` names the folders of the last two.

{table(header, rows)}

A share fell in {lower} of {frames} frames."""


def f_scores(run: Row) -> tuple[float, float] | None:
    """Return the F-score at 5 cm before and after fusion; None without ground truth."""
    truth = run["truth"]
    return truth and (truth["surface_before"]["f_score_5cm"], truth["surface_after"]["f_score_5cm"])


def _falls(numbers: Row) -> str:
    """Return the number of scenes in which the F-score falls, by preset."""
    parts = []
    for preset in next(iter(numbers.values())):
        judged = [pair for scene in numbers.values() if (pair := f_scores(scene[preset]))]
        lower = sum(after < before for before, after in judged)
        parts.append(f"{lower} of {len(judged)} scenes by the preset `{preset}`")
    return listed(parts)


def claims(numbers: Row, *between: str) -> str:
    """Return every claim with its verdict, the texts ``between``, and the claims' tables in ``SHOWN``."""
    rows = [
        (name, claim["claim"], claim["thesis"], claim["verdict"], claim["why"])
        for name, claim in numbers.items()
    ]
    verdicts = table(("", "claim", "the thesis", "verdict", "ours"), rows)
    return "\n\n".join((verdicts, *between, *_shown(numbers)))


def our_claims(numbers: Row) -> str:
    """Return our own claims, in the form of ``claims``."""
    rows = [
        (name, claim["claim"], claim["tolerance"], claim["verdict"], claim["why"])
        for name, claim in numbers.items()
    ]
    verdicts = table(("", "claim", "it holds if", "verdict", "ours"), rows)
    return "\n\n".join((verdicts, *_shown(numbers)))


def _shown(numbers: Row) -> list[str]:
    """Return the claims' tables in ``SHOWN``."""
    return [exhibit(numbers[name], title) for name, title in SHOWN if name in numbers]


def filling(numbers: Row) -> str:
    """Return the results on hidden holes, filled by us and by the peers."""
    speed, *runs = numbers["depth"]["runs"]
    seconds = {"packetmesh": numbers["depth"]["ours_s"], **numbers["depth"]["peers"]}
    times = table(("program", "ms a frame"), ((name, 1000.0 * value) for name, value in seconds.items()))
    discs = [run for run in runs if ", disc" in run["group"]]
    shapes = [run for run in runs if ", disc" not in run["group"]]
    others = [run for run in shapes if run["program"] != "packetmesh"]
    kinds = dict.fromkeys(run["group"].partition(", disc of ")[0] for run in discs)
    by_size = (
        (kind, [_sized(run) for run in discs if run["group"].startswith(f"{kind}, disc")]) for kind in kinds
    )
    sizes = "\n\n".join(
        f"**Discs hidden: {kind}**\n\n{pivot(sized, 'program', ('group',), error)}" for kind, sized in by_size
    )
    best = [
        f"{group}: {_best(shapes, group, 'abs_rel', -1.0)} and {_best(shapes, group, 'close_share', 1.0)}"
        for group in dict.fromkeys(run["group"] for run in shapes)
    ]
    return f"""15 % of the sensor's depth is hidden in shapes of real holes, filled, and compared with what
was measured; rooms and demo scenes also have their own holes, judged by the truth. AbsRel over all hole
pixels, in brackets its 95 % interval / share of all hole pixels filled within 5 %. What a program leaves
empty takes the nearest measured depth. Intervals resample rooms and demo scenes, but of the real frames
only the hidden parts: they do not hold for other frames. *Flat guess*: one depth everywhere, aligned and
judged as ours. *Pixel baseline*: our network's depth along one robust line through the pixels that the
sensor has.

{pivot(shapes, "program", ("group",), lambda run: f"{error(run)} / {percent(run['close_share'])}")}

Smallest error, and most pixels within 5 %: {"; ".join(best)}. Error minus ours on the same pixels, 95 %
interval: above 0 the error is larger than ours; if the interval contains 0, neither is better:

{pivot(others, "program", ("group",), _excess)}

One disc hidden in each image, by its radius in an image 640 pixels wide; AbsRel over all its pixels:

{sizes}

{times}

The depth network alone takes {1000.0 * speed["elapsed_s"]:.0f} ms a frame (median of {speed["rounds"]})."""


def error(run: Row) -> str:
    """Return AbsRel over all hole pixels and its interval as text."""
    low, high = run["abs_rel_ci95"]
    return f"{run['abs_rel']:.4f} [{low:.4f}, {high:.4f}]"


def _excess(run: Row) -> str:
    low, high = run["excess_ci95"]
    return f"{low:+.4f} to {high:+.4f}"


def _sized(run: Row) -> Row:
    """Return a copy of a run whose group is the size of its discs."""
    return {**run, "group": run["group"].partition(", disc of ")[2]}


def _best(runs: Sequence[Row], group: str, measure: str, sign: float) -> str:
    return str(max((r for r in runs if r["group"] == group), key=lambda r: sign * r[measure])["program"])


def registration_claims(numbers: Row) -> str:
    """Return claims C16 to C20, with a table of point errors for each direction of matching."""
    return claims(
        numbers,
        "Median point error in centimetres and, in brackets, the share of rooms that end within 2 cm; "
        "all methods tuned with equal effort on other rooms, for source to target. A dash: the method did "
        "not take part.",
        *(part for direction in DIRECTIONS for part in _point_error_table(numbers, direction)),
    )


def _point_error_table(numbers: Row, direction: str) -> tuple[str, str, str]:
    """Return a heading, the table, and where ICP without and with a gate beats CEICP-A."""
    medians = point_errors(numbers, direction)
    methods = [method for method in METHODS if method in medians]
    conditions = dict.fromkeys(label for method in methods for label in medians[method])
    rows = [(label, *(medians[method].get(label) for method in methods)) for label in conditions]
    lines = [
        f"{rival} ends nearer to the truth than {ours} in: "
        f"{'; '.join(losses(medians, rival, ours)) or 'no condition'}."
        for ours in (OURS, f"{OURS} plane")
        for rival in ("icp", "icp-gated")
        if {ours, rival} <= set(medians)
    ]
    heading = f"**Matched {DIRECTIONS[direction]}**"
    return heading, table(("condition", *methods), rows), " ".join(lines)


def point_errors(numbers: Row, direction: str = "q2p") -> dict[str, dict[str, str]]:
    """Return median point error, cm, and share of rooms within 2 cm, as text, by method and condition."""
    title = f"Point error by condition, matched {DIRECTIONS[direction]}"
    found = next(table for table in numbers["C16"]["tables"] if table["title"] == title)
    labels = found["header"][1:]
    return {
        method: {
            label: f"{cell.split()[0]} ({cell.split()[-1]})"
            for label, cell in zip(labels, cells, strict=True)
            if cell is not None
        }
        for method, *cells in found["rows"]
    }


def losses(medians: dict[str, dict[str, str]], rival: str, ours: str = OURS) -> list[str]:
    """Return the conditions in which a rival's median error is below ours."""
    both = [
        (label, cell, medians[ours][label])
        for label, cell in medians[rival].items()
        if label in medians[ours]
    ]
    return [
        f"{label} ({theirs.split()[0]} against {mine.split()[0]} cm)"
        for label, theirs, mine in both
        if float(theirs.split()[0]) < float(mine.split()[0])
    ]


def registration_speed(numbers: Row) -> str:
    """Return a table for each case: time, error and memory of registering two views of a room, by program."""
    header = ("program", "seconds", "95th percentile", "point error, mm", "peak memory, MB")
    parts = []
    for case, result in numbers.items():
        seconds = {OURS: result["ours_s"], **result["peers"]}
        memory = {OURS: result["peak_memory_bytes"], **result["peer_memory_bytes"]}
        times = {
            name: [run["elapsed_s"] for run in result["runs"] if run["program"] == name] for name in seconds
        }
        rows: list[Sequence[Cell]] = [
            (
                *(name, value, float(np.percentile(times[name], 95.0)) if times[name] else None),
                *(1000.0 * result["errors_m"][name], memory[name] / 1e6),
            )
            for name, value in seconds.items()
        ]
        parts.append(f"**{case}**\n\n{table(header, rows)}")
    return "\n\n".join(
        (
            "Two views of a room, 6° and 13 cm apart, preparation included, the programs in turn; medians "
            "and 95th percentiles of the rounds.",
            *parts,
        )
    )


def rolling_speed(numbers: Row) -> str:
    """Return tables of ball pivoting: time, covered share and memory of every program, by cloud and balls."""
    runs = numbers["surface"]["runs"]
    columns = ("cloud", "balls")
    points = listed(list(dict.fromkeys(f"{run['cloud']} {run['points']:,}" for run in runs)))
    return f"""Points: {points}. Each program in a process of its own; medians of the rounds. Seconds:

{pivot(runs, "program", columns, lambda run: text(run["elapsed_s"]))}

Share of the points with the mesh within half a point spacing:

{pivot(runs, "program", columns, lambda run: percent(run["covered_share"]))}

Memory on top of the cloud, MB:

{pivot(runs, "program", columns, lambda run: text(run["added_memory_bytes"] / 1e6))}"""


def network_speed(numbers: Row) -> str:
    """Return the speed of the street study, and of saturated nodes compared with ns-3."""
    result = numbers["network"]
    total, *runs = result["runs"]
    street, saturated = ([run for run in runs if key in run] for key in ("scheme", "mac"))
    vehicles, hours = street[0]["vehicles"], street[0]["simulated_s"] / 3600.0
    schemes = len({run["scheme"] for run in street})
    rows = [
        (
            *(run["mac"], run["nodes"], run["network_sim"]["simulated_s_per_s"]),
            run["ns3"] and run["ns3"]["simulated_s_per_s"],
            *(run["time_ratio"], run["throughput_ratio"], run["verdict"]),
        )
        for run in saturated
    ]
    header = (
        *("medium access", "nodes", "simulated s a second", "ns-3"),
        *("wall time, ours over ns-3's", "throughput, ours over ns-3's", "verdict"),
    )
    return f"""The street with {vehicles} vehicles, {len(street)} runs of {hours:.3g} hours by {schemes}
schemes, takes {result["ours_s"]:.0f} s: {total["simulated_s_per_s"]:,.0f} simulated seconds in a second, with
at most {result["peak_memory_bytes"] / 1e9:.2f} GB in a process. Saturated nodes around one sink:

{table(header, rows)}"""


def ns3_throughput(numbers: Row) -> str:
    """Return a table of both programs' throughput of saturated nodes around one sink."""
    rows = [
        (
            *(run["mac"], run["nodes"], run["network_sim"]["throughput_bps"] / 1e3),
            *(run[one] and run[one]["throughput_bps"] / 1e3 for one in ("ns3", "ns3_strict")),
            *(run["ratio"], run["verdict"]),
        )
        for run in numbers["rows"]
    ]
    header = ("medium access", "nodes", "ours, kb/s", "ns-3, kb/s", "ns-3 strict, kb/s", "ratio", "verdict")
    reasons = "".join(f"\n\n{mac}: {reason}." for mac, reason in numbers["reasons"].items())
    return table(header, rows) + reasons


def problems(numbers: Row) -> str:
    """Return results on lists of registration problems, of our rooms and a published LiDAR pair."""
    rows = [
        (
            *(group["list"].removesuffix("_local"), group["method"], group["problems"]),
            percent(group["solved_share"], 0),
            *(group["median_error"], group["upper_quartile_error"], group["median_s"]),
        )
        for group in numbers["summary"]
    ]
    header = ("list", "method", "problems", "solved", "error, median", "upper quartile", "seconds, median")
    return (
        f"{table(header, rows)}\n\nError: displacement of the points over their distance to the centroid "
        "(arXiv 2003.12841); solved: below 0.05. The peers start at the identity with the gate that our "
        "search found; ours also searches for other start poses. Each source, aligned with its target, is "
        "turned by up to 45° about the place where its middle was before, and shifted by up to a fifth of "
        "its size. box-rooms: five rooms that no claim uses, of two cameras; lidar: the pair in small_gicp's "
        "source archive; each moved ten ways. Lists: `python -m lab.benchmarks.problem_lists runs/problems "
        "--lidar DATA`."
    )


def chain_speed(numbers: Row) -> str:
    """Return tables of the chain's time, whole and by stage, and of its memory, after warm-up."""
    rows = [(case, result["ours_s"], result["peak_memory_bytes"] / 1e6) for case, result in numbers.items()]
    whole = table(("case", "seconds, warm", "peak memory, MB"), rows)
    stages = [run["stage"] for run in next(iter(numbers.values()))["runs"]]
    if not stages:  # an older record
        return whole
    by_stage = [(case, *(run["elapsed_s"] for run in result["runs"])) for case, result in numbers.items()]
    heading = "Seconds of each stage; after and before are computed side by side:"
    return f"{whole}\n\n{heading}\n\n{table(('case', *stages), by_stage)}"
